//! Materials of OBJ files: MTL libraries as surfaces of glTF's kind.

use super::Watched;
use super::beside::Beside;
use super::error::Result;
use super::obj::Named;
use super::picture::{Pictures, load};
use super::skipped::Skipped;
use super::text::Words;
use crate::stage::{Alpha, Image, Material, Stage, Texture, Wrap};
use std::collections::{HashMap, HashSet};

/// Statements of one material, as they stand in the file.
#[derive(Default)]
struct Raw {
    kd: Option<[f32; 3]>,
    ks: Option<[f32; 3]>,
    ke: Option<[f32; 3]>,
    tf: Option<[f32; 3]>,
    ns: Option<f32>,
    ni: Option<f32>,
    d: Option<f32>,
    tr: Option<f32>,
    pr: Option<f32>,
    pm: Option<f32>,
    illum: Option<f32>,
    map_kd: Option<Map>,
    map_ke: Option<Map>,
    map_d: Option<Map>,
    norm: Option<Map>,
    bump: Option<Map>,
}

/// An image with its options.
#[derive(Clone)]
struct Map {
    file: String,
    clamps: bool,
}

/// Gives a stage the materials that an OBJ file names. Libraries and images that cannot be had are left out, with
/// sentences.
pub fn dress(
    stage: &mut Stage,
    named: &Named,
    beside: &Beside<'_>,
    limits: &Watched<'_>,
) -> Result<()> {
    let (mut skipped, mut library) = (Skipped::default(), HashMap::new());
    let mut seen = HashSet::new();
    for names in named.libraries.iter().filter(|&names| seen.insert(names)) {
        read_libraries(names, beside, &mut library, &mut skipped);
    }
    let mut pictures = Pictures::default();
    for name in &named.materials {
        let material = match library.get(name) {
            Some(raw) => translate(raw, beside, &mut pictures, &mut skipped, limits)?,
            None => {
                if !name.is_empty() {
                    skipped.note_named("materials that no library of the file has", name);
                }
                Material::default()
            }
        };
        stage.materials.push(Material { name: name.clone(), ..material });
    }
    stage.images = pictures.images;
    stage.skipped.extend(skipped.sentences());
    Ok(())
}

/// Reads the files behind one `mtllib`: one whose name may hold spaces, or several.
fn read_libraries(
    names: &str,
    beside: &Beside<'_>,
    library: &mut HashMap<String, Raw>,
    skipped: &mut Skipped,
) {
    let read = |name: &str| load(beside, &slashes(name));
    if let Ok(text) = read(names) {
        return read_library(&text, library, skipped);
    }
    for name in names.split_ascii_whitespace().take(100) {
        match read(name) {
            Ok(text) => read_library(&text, library, skipped),
            Err(why) => skipped.note_named(&format!("material libraries, {why}"), name),
        }
    }
}

/// Paths of MTL files come from Windows too.
fn slashes(name: &str) -> String {
    name.replace('\\', "/")
}

fn read_library(text: &[u8], library: &mut HashMap<String, Raw>, skipped: &mut Skipped) {
    let mut words = Words::new(text, 1, Some(b'#'));
    let mut current: Option<(String, Raw)> = None;
    // Of two materials of one name the first one counts.
    let mut keep = |material: Option<(String, Raw)>| {
        if let Some((name, raw)) = material {
            library.entry(name).or_insert(raw);
        }
    };
    while let Some(word) = words.next() {
        let key = String::from_utf8_lossy(word).to_ascii_lowercase();
        let rest = words.rest_of_line();
        if key == "newmtl" {
            let name = String::from_utf8_lossy(rest.trim_ascii()).into_owned();
            keep(current.replace((name, Raw::default())));
        } else if let Some((_, raw)) = &mut current {
            statement(raw, &key, rest, skipped);
        }
    }
    keep(current);
}

fn statement(raw: &mut Raw, key: &str, rest: &[u8], skipped: &mut Skipped) {
    let text = String::from_utf8_lossy(rest);
    // A comment may follow numbers; names of files may hold the sign.
    let head = text.split('#').next().unwrap_or_default();
    let numbers: Vec<f32> =
        head.split_ascii_whitespace().take(3).map_while(|word| word.parse().ok()).collect();
    let number = numbers.first().copied().filter(|x| x.is_finite());
    let color = match numbers[..] {
        [r, g, b] if numbers.iter().all(|x| x.is_finite()) => Some([r, g, b]),
        [grey] if grey.is_finite() => Some([grey; 3]),
        _ => None,
    };
    let is_spectral =
        head.trim_start().starts_with("spectral") || head.trim_start().starts_with("xyz");
    let map = || map(&text);
    match key {
        "kd" | "ks" | "ke" | "tf" if is_spectral => skipped.note(format!("{key} as a spectrum")),
        "kd" => raw.kd = color,
        "ks" => raw.ks = color,
        "ke" => raw.ke = color,
        "tf" => raw.tf = color,
        "ns" => raw.ns = number,
        "ni" => raw.ni = number,
        "d" if head.trim_start().starts_with("-halo") => skipped.note("d -halo of MTL files"),
        "d" => raw.d = number,
        "tr" => raw.tr = number,
        "pr" => raw.pr = number,
        "pm" => raw.pm = number,
        "illum" => raw.illum = number,
        "map_kd" => raw.map_kd = map(),
        "map_ke" => raw.map_ke = map(),
        "map_d" => raw.map_d = map(),
        "norm" => raw.norm = map(),
        "bump" | "map_bump" => raw.bump = map(),
        // Ambient light is no property of a surface here.
        "ka" | "map_ka" | "sharpness" => return,
        _ => skipped.note(format!("{key} of MTL files")),
    }
    let shifts = |option: &str| text.split_ascii_whitespace().any(|word| word == option);
    if (key.starts_with("map_") || key == "norm") && (shifts("-s") || shifts("-o") || shifts("-t"))
    {
        skipped.note("options -s, -o and -t of textures");
    }
}

/// The name of an image behind its options.
fn map(text: &str) -> Option<Map> {
    let (mut text, mut clamps) = (text.trim(), false);
    let split = |text: &str| -> (usize, usize) {
        let end = text.find(char::is_whitespace).unwrap_or(text.len());
        let next = text[end..].trim_start();
        (end, text.len() - next.len())
    };
    while text.starts_with('-') {
        let (end, next) = split(text);
        let (option, rest) = (&text[..end], &text[next..]);
        text = rest;
        let mut word = || {
            let (end, next) = split(text);
            let word = &text[..end];
            text = &text[next..];
            word
        };
        match option {
            "-clamp" => clamps = word() == "on",
            "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-texres" | "-type" | "-bm" | "-boost" => {
                word();
            }
            "-mm" => {
                word();
                word();
            }
            "-s" | "-o" | "-t" => {
                // One to three numbers.
                for _ in 0..3 {
                    let (end, next) = split(text);
                    if text[..end].parse::<f32>().is_err() || next == text.len() {
                        break;
                    }
                    text = &text[next..];
                }
            }
            _ => {
                // No option: a name that begins so.
                let file = format!("{option} {text}").trim().to_owned();
                return Some(Map { file: slashes(&file), clamps });
            }
        }
    }
    (!text.is_empty()).then(|| Map { file: slashes(text), clamps })
}

impl Raw {
    /// True if nothing could be seen of the surface, by a statement that some programs mean the other way round.
    fn is_gone(&self) -> bool {
        self.d.is_none() && self.tr.is_some_and(|tr| tr >= 1.0)
    }
}

fn translate(
    raw: &Raw,
    beside: &Beside<'_>,
    pictures: &mut Pictures,
    skipped: &mut Skipped,
    limits: &Watched<'_>,
) -> Result<Material> {
    if raw.is_gone() {
        skipped.note("Tr 1 of MTL files, which MeshLab writes of opaque surfaces");
    }
    let mut material = plain(raw);
    let mut texture = |map: &Option<Map>, pictures: &mut Pictures| -> Result<Option<Texture>> {
        let Some(Map { file, clamps }) = map else {
            return Ok(None);
        };
        let image = pictures.get(file, || load(beside, file), skipped, limits)?;
        let wrap = if *clamps { Wrap::Clamp } else { Wrap::Repeat };
        Ok(image.map(|image| Texture { image, wrap: [wrap; 2] }))
    };
    material.base_color_texture = texture(&raw.map_kd, pictures)?;
    material.emission_texture = texture(&raw.map_ke, pictures)?;
    material.normal_texture = texture(&raw.norm, pictures)?;
    if material.emission_texture.is_none() && raw.ke.is_none() {
        material.emission = [0.0; 3];
    }
    if material.normal_texture.is_none()
        && let Some(bump) = texture(&raw.bump, pictures)?
    {
        if is_normal_map(&pictures.images[bump.image as usize]) {
            material.normal_texture = Some(bump);
        } else {
            skipped.note("bump maps of heights");
        }
    }
    if let Some(Map { file, clamps }) = &raw.map_d {
        let base = material.base_color_texture;
        let wrap =
            base.map_or([if *clamps { Wrap::Clamp } else { Wrap::Repeat }; 2], |base| base.wrap);
        let image = base.map(|base| base.image);
        if let Some(image) = pictures.masked(image, file, || load(beside, file), skipped, limits)? {
            material.base_color_texture = Some(Texture { image, wrap });
            material.alpha = Alpha::Blend;
        }
    }
    Ok(material)
}

/// The surface without its images.
fn plain(raw: &Raw) -> Material {
    let default = Material::default();
    let share = |x: f32| x.clamp(0.0, 1.0);
    let is_black = |color: Option<[f32; 3]>| color.is_none_or(|c| c.iter().all(|&x| x <= 0.0));
    // White under an image, if nothing or black is said.
    let kd = match raw.kd {
        Some(kd) if raw.map_kd.is_none() || !is_black(Some(kd)) => kd.map(share),
        _ if raw.map_kd.is_some() => [1.0; 3],
        _ => default.base_color,
    };
    let illum = raw.illum.map_or(-1, |x| x as i32);
    let tr = raw.tr.filter(|_| !raw.is_gone());
    let opacity = share(raw.d.or(tr.map(|tr| 1.0 - tr)).unwrap_or(1.0));
    let lets_through = opacity < 1.0 || !is_black(raw.tf);
    let is_glass = matches!(illum, 6 | 7) || matches!(illum, 4 | 9) && lets_through;
    let is_metal = !is_glass
        && raw.pm.is_none()
        && raw.map_kd.is_none()
        && raw.kd.is_some()
        && is_black(raw.kd)
        && !is_black(raw.ks)
        && !matches!(illum, 0 | 1);
    // Blinn's exponent of a lobe as wide as that of GGX: n = 2 / alpha^2 - 2 (Walter et al. 2007), alpha the
    // square of roughness.
    let shines = !is_black(raw.ks) && !matches!(illum, 0 | 1);
    let by_exponent = raw.ns.filter(|_| shines).map(|ns| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25));
    let roughness = match (raw.pr, is_glass) {
        (Some(roughness), _) => share(roughness),
        (None, true) => 0.0,
        (None, false) => by_exponent.unwrap_or(if is_metal { 0.0 } else { 1.0 }),
    };
    let ior = match raw.ni {
        Some(ni) if ni > 1.0 || ni == 1.0 && is_glass => ni,
        _ => default.ior,
    };
    let emission = match (raw.ke, &raw.map_ke) {
        (Some(ke), map) if map.is_none() || !is_black(Some(ke)) => ke.map(|x| x.max(0.0)),
        (_, Some(_)) => [1.0; 3],
        _ => [0.0; 3],
    };
    let tint = match (raw.tf, raw.kd) {
        (Some(tf), _) if !is_black(raw.tf) => tf.map(share),
        (_, Some(_)) if !is_black(raw.kd) => kd,
        _ => [1.0; 3],
    };
    Material {
        base_color: match (is_glass, is_metal) {
            (true, _) => tint,
            (_, true) => raw.ks.unwrap_or_default().map(share),
            _ => kd,
        },
        opacity: if is_glass { 1.0 } else { opacity },
        alpha: if opacity < 1.0 && !is_glass { Alpha::Blend } else { Alpha::Opaque },
        metallic: if is_metal { 1.0 } else { share(raw.pm.unwrap_or(0.0)) },
        roughness,
        emission,
        transmission: if is_glass { 1.0 } else { 0.0 },
        ior,
        ..default
    }
}

/// True of an image whose mean is that of unit vectors which mostly point outwards.
fn is_normal_map(image: &Image) -> bool {
    let mut sums = [0u64; 3];
    for pixel in &image.pixels {
        (0..3).for_each(|channel| sums[channel] += u64::from(pixel[channel]));
    }
    let [r, g, b] = sums.map(|sum| sum / image.pixels.len().max(1) as u64);
    b > 160 && (96..160).contains(&r) && (96..160).contains(&g)
}
