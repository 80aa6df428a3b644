//! The generators by themselves: counts, golden words, size ranges, streaming.

mod spd_words;

use ropewalk_scene::spd::{Spd, SpdError, generate};
use ropewalk_scene::{Camera, Light, Material, SceneSink, Surface};
use spd_words::{each_word, percent_g};

/// Counts the pieces of a scene, checks that each is well formed, and fails after `limit` objects.
struct Inspector {
    heads: u64,
    materials: u64,
    objects: u64,
    limit: u64,
}

/// The error of an [`Inspector`] that has reached its limit.
#[derive(Debug, PartialEq)]
struct Full;

impl Inspector {
    fn new(limit: u64) -> Inspector {
        Inspector { heads: 0, materials: 0, objects: 0, limit }
    }

    fn points(points: &[[f64; 3]]) {
        assert!(points.iter().flatten().all(|x| x.is_finite()), "{points:?}");
    }
}

impl SceneSink for Inspector {
    type Error = Full;

    fn comment(&mut self, _: &str) -> Result<(), Full> {
        Ok(())
    }

    fn background(&mut self, color: [f64; 3]) -> Result<(), Full> {
        Self::points(&[color]);
        self.heads += 1;
        Ok(())
    }

    fn camera(&mut self, camera: &Camera) -> Result<(), Full> {
        Self::points(&[camera.from, camera.at, camera.up]);
        assert!(camera.from != camera.at && camera.angle > 0.0);
        self.heads += 1;
        Ok(())
    }

    fn light(&mut self, light: &Light) -> Result<(), Full> {
        Self::points(&[light.position]);
        assert_eq!(self.objects, 0, "lights come first");
        Ok(())
    }

    fn material(&mut self, m: &Material) -> Result<(), Full> {
        Self::points(&[
            m.color,
            [m.kd, m.ks, m.shine],
            [m.transmittance, m.index_of_refraction, 0.],
        ]);
        self.materials += 1;
        Ok(())
    }

    fn surface(&mut self, surface: &Surface) -> Result<(), Full> {
        assert!(self.heads == 2 && self.materials > 0, "an object before the head of the scene");
        match surface {
            Surface::Sphere { center, radius } => {
                Self::points(&[*center]);
                assert!(radius.is_finite() && *radius > 0.0);
            }
            Surface::Cone(cone) => {
                Self::points(&[cone.base, cone.apex]);
                assert!(cone.base != cone.apex && cone.base_radius > 0.0 && cone.apex_radius > 0.0);
            }
            Surface::Polygon(vertices) => {
                assert!(vertices.len() >= 3);
                Self::points(vertices);
            }
            Surface::Patch { vertices, normals } => {
                assert!(vertices.len() == 3 && normals.len() == 3);
                Self::points(vertices);
                for n in normals {
                    let square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
                    assert!((square - 1.0).abs() < 1e-12, "a normal of length^2 {square}");
                }
            }
        }
        if self.objects == self.limit {
            return Err(Full);
        }
        self.objects += 1;
        Ok(())
    }
}

#[test]
fn object_counts_hold_and_all_numbers_are_finite() {
    /// Objects of the largest scene that is generated here.
    const MAX_OBJECTS: u64 = 100_000;
    for spd in Spd::ALL {
        let sizes = spd.sizes().take_while(|&size| spd.object_count(size) <= MAX_OBJECTS);
        for size in sizes {
            let mut inspector = Inspector::new(u64::MAX);
            generate(spd, size, &mut inspector).unwrap();
            assert_eq!(inspector.objects, spd.object_count(size), "{spd} {size}");
        }
    }
}

#[test]
fn standard_sizes_have_the_published_counts() {
    let published = [
        (Spd::Balls, 7_382),
        (Spd::Gears, 9_345),
        (Spd::Mount, 8_196),
        (Spd::Rings, 8_401),
        (Spd::Teapot, 9_264),
        (Spd::Tetra, 4_096),
        (Spd::Tree, 8_191),
        (Spd::Lattice, 8_281),
    ];
    for (spd, count) in published {
        assert_eq!(spd.object_count(spd.standard_size()), count, "{spd}");
    }
}

/// FNV-1a (64 bits) of the words of a scene, each followed by a line feed.
fn hash(spd: Spd, size: u32) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    each_word(spd, size, |word| {
        for byte in word.bytes().chain([b'\n']) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    });
    hash
}

/// The hashes are those of the output of the published C programs, version 3.13.
#[test]
#[cfg_attr(not(target_env = "gnu"), ignore = "the last digits are those of glibc's functions")]
fn scenes_are_those_of_the_published_programs() {
    let golden = [
        (Spd::Balls, 1, 0xcb90_58f5_afb3_89b9),
        (Spd::Balls, 2, 0x404c_ab76_edd0_0793),
        (Spd::Gears, 1, 0x22f3_b663_98c8_567b),
        (Spd::Gears, 3, 0x13f6_9869_84f9_4e58),
        (Spd::Mount, 3, 0x96fa_6a97_d27f_12a9),
        (Spd::Mount, 5, 0x15e3_95d4_e8dc_bf26),
        (Spd::Rings, 1, 0x80bb_4599_7616_0440),
        (Spd::Rings, 4, 0x712c_2313_cd37_8dce),
        (Spd::Teapot, 1, 0x8ab4_21cb_5ad5_83fd),
        (Spd::Teapot, 3, 0x03cc_1532_0d1e_cf24),
        (Spd::Tetra, 1, 0xe3ca_0981_d9bb_46e2),
        (Spd::Tetra, 4, 0x4823_8db8_98a7_4e94),
        (Spd::Tree, 1, 0x3edb_98ff_2647_6fbb),
        (Spd::Tree, 7, 0xe8cf_ea7a_35c5_6549),
        (Spd::Lattice, 1, 0x909d_cba2_60ec_e3d2),
        (Spd::Lattice, 5, 0xe848_66b7_936c_8512),
        (Spd::Jacks, 1, 0xfedd_1722_1df6_5e1e),
        (Spd::Jacks, 4, 0x5565_6d0d_3a06_8ddc),
        (Spd::Shells, 1, 0xc655_eae5_ae23_7b9b),
        (Spd::Shells, 5, 0xaa98_bd5c_35c1_aa26),
        (Spd::Sombrero, 2, 0xbcc0_bc20_fb6b_f627),
        (Spd::Sample, 1, 0x5e58_5c92_1d41_e12f),
    ];
    for (spd, size, expected) in golden {
        let found = hash(spd, size);
        assert_eq!(found, expected, "{spd} {size}: {found:#x}, expected {expected:#x}");
    }
}

#[test]
fn sizes_end_where_objects_cannot_be_numbered() {
    for spd in Spd::ALL {
        let (first, last) = (*spd.sizes().start(), *spd.sizes().end());
        assert!(spd.sizes().contains(&spd.standard_size()), "{spd}");
        assert!(spd.object_count(last) <= u64::from(u32::MAX), "{spd}");
        for size in [first - 1, last + 1, u32::MAX] {
            let mut inspector = Inspector::new(u64::MAX);
            let error = generate(spd, size, &mut inspector).unwrap_err();
            assert_eq!(error, SpdError::SizeOutOfRange { spd, size });
            assert_eq!(inspector.heads + inspector.materials + inspector.objects, 0);
            assert_eq!(spd.object_count(size), 0);
        }
    }
    let error = SpdError::<std::convert::Infallible>::SizeOutOfRange { spd: Spd::Balls, size: 11 };
    assert_eq!(
        error.to_string(),
        "size 11 of the database balls is out of range: expected 1 to 10"
    );
}

#[test]
fn the_largest_sizes_begin_well() {
    /// Objects that are looked at: the recursions have reached their depth by then.
    const BEGINNING: u64 = 1_000;
    for spd in Spd::ALL {
        let mut inspector = Inspector::new(BEGINNING);
        match generate(spd, spd.max_size(), &mut inspector) {
            Err(error) => assert_eq!(error, SpdError::Sink(Full), "{spd}"),
            Ok(()) => assert!(spd.object_count(spd.max_size()) <= BEGINNING, "{spd}"),
        }
    }
}

#[test]
fn names_lead_back_to_the_databases() {
    for spd in Spd::ALL {
        assert_eq!(Spd::from_name(spd.name()), Some(spd));
        assert_eq!(spd.to_string(), spd.name());
        assert_eq!(spd.one_sided_opaque(), spd != Spd::Teapot);
    }
    assert_eq!(Spd::from_name("Balls"), None);
    assert_eq!(Spd::from_name(""), None);
}

/// Counts objects and nothing else.
struct Counter(u64);

impl SceneSink for Counter {
    type Error = std::convert::Infallible;

    fn comment(&mut self, _: &str) -> Result<(), Self::Error> {
        Ok(())
    }
    fn background(&mut self, _: [f64; 3]) -> Result<(), Self::Error> {
        Ok(())
    }
    fn camera(&mut self, _: &Camera) -> Result<(), Self::Error> {
        Ok(())
    }
    fn light(&mut self, _: &Light) -> Result<(), Self::Error> {
        Ok(())
    }
    fn material(&mut self, _: &Material) -> Result<(), Self::Error> {
        Ok(())
    }
    fn surface(&mut self, surface: &Surface) -> Result<(), Self::Error> {
        self.0 += u64::from(std::hint::black_box(surface) == surface);
        Ok(())
    }
}

#[test]
fn millions_of_objects_stream_through() {
    for (spd, size) in
        [(Spd::Balls, 6), (Spd::Tetra, 10), (Spd::Lattice, 64), (Spd::Mount, 9), (Spd::Teapot, 100)]
    {
        let mut counter = Counter(0);
        generate(spd, size, &mut counter).unwrap();
        assert_eq!(counter.0, spd.object_count(size), "{spd} {size}");
        assert!(counter.0 > 500_000);
    }
}

/// Ten million objects: `cargo test --release --test spd -- --ignored --nocapture ten_million`.
#[test]
#[ignore = "a measurement"]
fn ten_million_objects_of_each_database() {
    for spd in Spd::ALL {
        let Some(size) = spd.sizes().find(|&size| spd.object_count(size) >= 10_000_000) else {
            continue;
        };
        let mut counter = Counter(0);
        let start = std::time::Instant::now();
        generate(spd, size, &mut counter).unwrap();
        assert_eq!(counter.0, spd.object_count(size), "{spd} {size}");
        println!("{spd} {size}: {} objects, {:.2} s", counter.0, start.elapsed().as_secs_f64());
    }
}

#[test]
fn percent_g_prints_as_c_does() {
    for (x, expected) in [
        (0.0, "0"),
        (-0.0, "-0"),
        (1.0, "1"),
        (-1.5, "-1.5"),
        (100_000.0, "100000"),
        (999_999.5, "1e+06"),
        (1_234_567.0, "1.23457e+06"),
        (0.0001, "0.0001"),
        (0.00001234567, "1.23457e-05"),
        (6.123233995736766e-17, "6.12323e-17"),
        (1e100, "1e+100"),
        (-0.9921875, "-0.992188"),
        (0.0078125, "0.0078125"),
        (1.0 / 3.0, "0.333333"),
        (2.9999999, "3"),
        (1.015625, "1.01562"),
    ] {
        assert_eq!(percent_g(x), expected);
    }
}
