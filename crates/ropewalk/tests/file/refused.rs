//! Bytes that are no sound scene, and what is said about them.

use crate::double::ReadyDouble;
use crate::property::{opens_or_refuses, repair, shared};
use crate::scenes::{Ready, all, coincident, soup};
use ropewalk::file::{Check, FileError, HEADER_BYTES, Opened, Section, Tag, open};
use ropewalk::kernel::BatchCaster;
use ropewalk_testkit::rays::Draw;

fn refusal(bytes: &[u8]) -> String {
    let error = open(&shared(bytes), Check::Structure).err().expect("it must be refused");
    assert!(!opens_or_refuses(bytes));
    error.to_string()
}

fn sections(bytes: &[u8]) -> Vec<Section> {
    open(&shared(bytes), Check::Structure).unwrap().sections
}

fn section(bytes: &[u8], tag: Tag) -> Section {
    sections(bytes).into_iter().find(|section| section.tag == tag).unwrap()
}

/// Some bytes changed, and the header repaired.
fn changed(bytes: &[u8], at: usize, new: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at..at + new.len()].copy_from_slice(new);
    repair(&mut bytes);
    bytes
}

#[test]
fn something_else_altogether() {
    assert_eq!(
        refusal(b"P6\n1 1\n255\n\0\0\0"),
        "no saved scene: at offset 0, expected the bytes \"ROPEWALK\", found \"P6\\n1 1\\n2\""
    );
    assert_eq!(
        refusal(b""),
        "no saved scene: at offset 0, expected the bytes \"ROPEWALK\", found \"\""
    );
}

#[test]
fn other_versions_and_byte_orders() {
    let bytes = Ready::new(soup(20, 1, false)).bytes();
    assert_eq!(
        refusal(&changed(&bytes, 12, &[0])),
        "format version 0 at offset 12; this program reads version 1; save the scene again"
    );
    assert_eq!(
        refusal(&changed(&bytes, 12, &[2])),
        "format version 2 at offset 12; this program reads version 1; it was saved by a newer program"
    );
    assert_eq!(
        refusal(&changed(&bytes, 16, &[9])),
        "tree layout version 9 at offset 16; this program reads version 1; it was saved by a newer program"
    );
    let mut swapped = bytes.clone();
    for word in swapped[8..24].chunks_exact_mut(4) {
        word.reverse();
    }
    assert_eq!(
        refusal(&swapped),
        "the numbers are big-endian: at offset 8, expected 0x01020304, found 0x04030201"
    );
    assert_eq!(
        refusal(&changed(&bytes, 8, &[7])),
        "header, offset 8: the mark of the byte order is 0x01020307; expected 0x01020304"
    );
}

/// A file may end anywhere.
#[test]
fn cut_off_at_every_section_and_anywhere() {
    for (name, ready) in all() {
        let bytes = ready.bytes();
        let mut ends: Vec<usize> = (0..HEADER_BYTES + 64).collect();
        for section in sections(&bytes) {
            let range = section.range();
            for end in [range.start, range.start + range.len() / 2, range.end] {
                ends.extend(end.saturating_sub(2)..end + 2);
            }
        }
        let mut draw = Draw::new(1);
        ends.extend((0..100).map(|_| draw.below(bytes.len())));
        for end in ends.into_iter().filter(|&end| end < bytes.len()) {
            let mut bytes = bytes[..end].to_vec();
            let sentence = refusal(&bytes);
            if end >= HEADER_BYTES {
                assert!(
                    sentence.starts_with("the file is cut off: expected "),
                    "{name}: {sentence}"
                );
            }
            repair(&mut bytes);
            refusal(&bytes);
        }
        let mut longer = bytes.clone();
        longer.extend([0; 64]);
        assert!(refusal(&longer).starts_with("the file is too long: expected "), "{name}");
        repair(&mut longer);
        refusal(&longer);
    }
}

#[test]
fn any_altered_byte_is_found_by_the_full_check() {
    for (name, ready) in all() {
        let bytes = ready.bytes();
        let mut draw = Draw::new(2);
        let mut places: Vec<usize> = (0..400).map(|_| draw.below(bytes.len())).collect();
        places.extend(0..HEADER_BYTES + 64);
        for at in places {
            let mut bytes = bytes.clone();
            bytes[at] ^= 1 << draw.below(8);
            assert!(open(&shared(&bytes), Check::Everything).is_err(), "{name} {at}");
        }
    }
    let bytes = Ready::new(soup(100, 3, false)).bytes();
    let triangles = section(&bytes, Tag::TRIANGLES);
    let mut altered = bytes.clone();
    altered[triangles.range().start + 5] ^= 1;
    // Checksums are left to the full check.
    assert!(open(&shared(&altered), Check::Structure).is_ok());
    let error = open(&shared(&altered), Check::Everything).err().unwrap();
    let (FileError::Altered { offset, .. }, sentence) = (&error, error.to_string()) else {
        panic!("{error}")
    };
    assert_eq!(*offset, triangles.offset);
    let start =
        format!("section TRIS, offset {offset}: the bytes were altered; expected checksum ");
    assert!(sentence.starts_with(&start), "{sentence}");
    altered = bytes;
    altered[100] ^= 1;
    assert!(refusal(&altered).starts_with("header, offset 0: the bytes were altered; "));
}

#[test]
fn absurd_numbers() {
    let bytes = Ready::new(coincident(400)).bytes();
    let huge = (1u64 << 63).to_le_bytes();
    for at in (24..32).step_by(8).chain((152..192).step_by(8)) {
        for value in [huge, u64::MAX.to_le_bytes(), (1u64 << 32).to_le_bytes()] {
            let mut bytes = changed(&bytes, at, &value);
            if at == 24 {
                bytes[24..32].copy_from_slice(&value);
            }
            refusal(&bytes);
        }
    }
    for count in [0, 1, 33, u32::MAX] {
        refusal(&changed(&bytes, 20, &count.to_le_bytes()));
    }
    let entries = sections(&bytes).len();
    for entry in 0..entries {
        for field in [8, 16] {
            for value in [huge, u64::MAX.to_le_bytes(), [0; 8], 64u64.to_le_bytes()] {
                let at = HEADER_BYTES + 64 * entry + field;
                let sentence = refusal(&changed(&bytes, at, &value));
                assert!(sentence.contains("offset") || sentence.contains("bytes"), "{sentence}");
            }
        }
    }
    assert_eq!(
        refusal(&changed(&bytes, 152, &huge)),
        "header, offset 152: the number of primitives is 9223372036854775808; expected at most 1073741823"
    );
}

#[test]
fn sections_that_overlap_or_leave_room() {
    let bytes = Ready::new(soup(60, 4, true)).bytes();
    let second = HEADER_BYTES + 64 + 8;
    let first = section(&bytes, Tag::TREE);
    let before = first.range().end as u64 - 64;
    let sentence = refusal(&changed(&bytes, second, &before.to_le_bytes()));
    assert!(sentence.starts_with("section TRIS, offset 264: its beginning is "), "{sentence}");
    let behind = first.range().end as u64 + 64;
    refusal(&changed(&bytes, second, &behind.to_le_bytes()));
    // What lies between sections is zero.
    let sides = section(&bytes, Tag::SIDES).range().end;
    let sentence = refusal(&changed(&bytes, sides, &[1]));
    assert_eq!(
        sentence,
        format!("header, offset {sides}: a byte between sections is 1; expected 0")
    );
}

#[test]
fn names_that_must_be_known() {
    let bytes = Ready::new(soup(60, 4, true)).bytes();
    let name = |i: usize| HEADER_BYTES + 64 * i;
    let tags: Vec<Tag> = sections(&bytes).iter().map(|section| section.tag).collect();
    assert_eq!(tags, [Tag::TREE, Tag::TRIANGLES, Tag::SIDES, Tag::FIGURES]);
    for i in 0..2 {
        refusal(&changed(&bytes, name(i), b"what"));
    }
    for i in 0..4 {
        refusal(&changed(&bytes, name(i), b"WHAT"));
    }
    // One that need not be known is passed over.
    assert!(opens_or_refuses(&changed(&bytes, name(3), b"what")));
    for (i, tag) in [(3, b"TREE"), (3, b"TRIS"), (2, b"KIND"), (3, b"OVER"), (1, b"SIDE")] {
        refusal(&changed(&bytes, name(i), tag));
    }
    let control = refusal(&changed(&bytes, name(3), b"\x1bA\n\0"));
    assert!(control.contains("\\x1bA\\n\\x00"), "{control}");
}

#[test]
fn boxes_that_are_none() {
    let bytes = Ready::new(soup(60, 4, false)).bytes();
    for at in (96..144).step_by(4) {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            refusal(&changed(&bytes, at, &value.to_le_bytes()));
        }
    }
    refusal(&changed(&bytes, 96, &1e9f32.to_le_bytes()));
}

/// Where a child's code of the root stands.
fn child(bytes: &[u8], c: usize) -> usize {
    section(bytes, Tag::TREE).range().start + 64 + 32 + 4 * c
}

#[test]
fn links_that_lead_elsewhere() {
    let bytes = Ready::new(soup(400, 1, false)).bytes();
    let lines = section(&bytes, Tag::TREE).len as u32 / 64;
    let code = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let inner = (0..8).map(|c| child(&bytes, c)).find(|&at| code(at) != 0 && code(at) >> 31 == 0);
    let at = inner.expect("the root has a treelet below it");
    // Itself, the dummy, backwards, beyond the end, a leaf of too many blocks, of none, of an unknown number.
    for code in [
        1 << 4,
        (lines - 1) << 4,
        lines << 4,
        u32::MAX >> 1 & !15,
        u32::MAX,
        code(at) | 3,
        code(at) | 1 << 31,
        code(at) + 16,
        code(at) - 16,
        1 << 31 | 2 << 4 | 14,
        1 << 31 | 2 << 4,
        1 << 31 | 2 << 4 | 15,
        0,
    ] {
        let sentence = refusal(&changed(&bytes, at, &code.to_le_bytes()));
        assert!(sentence.starts_with("section TREE, offset "), "{code:#x}: {sentence}");
    }
    let sentence = refusal(&changed(&bytes, at, &(lines << 4).to_le_bytes()));
    assert!(
        sentence.contains(&format!("offset {at}: a treelet's line is {lines}; ")),
        "{sentence}"
    );
    for root in [0, 2 << 4, 1 << 31 | 1 << 4 | 1, 1 << 31 | 1 << 4 | 15, u32::MAX, 1 << 4 | 1] {
        refusal(&changed(&bytes, 144, &root.to_le_bytes()));
    }
}

/// A chain of treelets that is deeper than any stack.
#[test]
fn paths_that_are_too_long() {
    let bytes = Ready::new(soup(400, 1, false)).bytes();
    let tree = section(&bytes, Tag::TREE).range();
    let lines = tree.len() / 64;
    let mut chain = bytes.clone();
    for line in 1..lines {
        let at = tree.start + line * 64;
        chain[at + 32..at + 64].fill(0);
        chain[at..at + 28].copy_from_slice(&[0u8; 28]);
        chain[at + 28..at + 32].fill(0);
        if line + 1 < lines {
            let code = (line as u32 + 1) << 4;
            chain[at + 32..at + 36].copy_from_slice(&code.to_le_bytes());
        }
    }
    repair(&mut chain);
    let sentence = refusal(&chain);
    assert!(sentence.ends_with("a path is longer; expected at most 32 treelets"), "{sentence}");
}

#[test]
fn lists_of_large_leaves() {
    let bytes = Ready::new(coincident(400)).bytes();
    let list = section(&bytes, Tag::OVERFLOW).range();
    let pair = list.start;
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    for value in [0, 14, word(pair + 4) - 1, word(pair + 4) + 1, u32::MAX] {
        refusal(&changed(&bytes, pair + 4, &value.to_le_bytes()));
    }
    for value in [0, word(pair) + 1, u32::MAX] {
        refusal(&changed(&bytes, pair, &value.to_le_bytes()));
    }
}

#[test]
fn planes_and_axes_that_are_none() {
    let bytes = Ready::new(soup(400, 1, false)).bytes();
    let root = section(&bytes, Tag::TREE).range().start + 64;
    let sentence = refusal(&changed(&bytes, root + 8, &f32::NAN.to_le_bytes()));
    assert_eq!(sentence, format!("section TREE, offset {root}: a plane is NaN; expected a number"));
    let axes = u32::from_le_bytes(bytes[root + 28..root + 32].try_into().unwrap());
    for bit in 0..32 {
        refusal(&changed(&bytes, root + 28, &(axes ^ 1 << bit).to_le_bytes()));
    }
}

#[test]
fn figures_that_are_none() {
    let bytes = Ready::new(soup(30, 1, false)).bytes();
    let at = section(&bytes, Tag::FIGURES).range().start;
    for (offset, new) in [(0, &b"best!"[..]), (0, &[0xFF, 0xFE]), (3, &[0, 0])] {
        refusal(&changed(&bytes, at + offset, new));
    }
}

#[test]
fn shapes_that_are_none() {
    let bytes = all().into_iter().find(|(name, _)| *name == "mixed").unwrap().1.bytes();
    let scene = |bytes: &[u8]| open(&shared(bytes), Check::Structure);
    let Opened { geometry, .. } = scene(&bytes).unwrap();
    let kinds = section(&bytes, Tag::KINDS).range();
    let numbers = section(&bytes, Tag::NUMBERS).range();
    let ends = section(&bytes, Tag::ENDS).range();
    for i in 0..geometry.len() {
        refusal(&changed(&bytes, kinds.start + i, &[0x05]));
        refusal(&changed(&bytes, kinds.start + i, &[0x30]));
        let end = u64::MAX - i as u64;
        refusal(&changed(&bytes, ends.start + 8 * i, &end.to_le_bytes()));
    }
    for at in numbers.step_by(4 * 7) {
        refusal(&changed(&bytes, at, &f32::NAN.to_le_bytes()));
    }
}

/// Files that an earlier state of this program has written: each is opened as long as the versions stay what
/// they are. `cargo test -p ropewalk --test file -- --ignored write_corpus` writes them anew.
#[test]
fn the_fuzz_corpus_is_opened() {
    for (name, ready) in small() {
        let bytes = std::fs::read(corpus().join(format!("{name}.rope"))).unwrap();
        let scene = open(&shared(&bytes), Check::Everything).unwrap();
        let rays = crate::property::rays(&ready.geometry);
        let expected = BatchCaster::new(&ready.tree, &ready.geometry).closest_hit(&rays);
        let found = BatchCaster::new(&scene.tree, &scene.geometry).closest_hit(&rays);
        assert_eq!(found, expected, "{name}");
        assert!(opens_or_refuses(&bytes), "{name}");
    }
    let bytes = std::fs::read(corpus().join("double.rope")).unwrap();
    assert!(opens_or_refuses(&bytes) && bytes == ReadyDouble::new(30, 5).bytes());
}

#[test]
#[ignore = "it writes files of the repository"]
fn write_corpus() {
    std::fs::create_dir_all(corpus()).unwrap();
    for (name, ready) in small() {
        std::fs::write(corpus().join(format!("{name}.rope")), ready.bytes()).unwrap();
    }
    std::fs::write(corpus().join("double.rope"), ReadyDouble::new(30, 5).bytes()).unwrap();
}

fn corpus() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus-seed/file")
}

/// Scenes of few bytes.
fn small() -> Vec<(&'static str, Ready)> {
    let mixed = ropewalk_testkit::primitives::random_geometry(None, 12, 3);
    let mut scenes: Vec<_> =
        all().into_iter().filter(|(name, _)| matches!(*name, "empty" | "one" | "ball")).collect();
    scenes.push(("soup", Ready::new(soup(60, 1, true))));
    scenes.push(("coincident", Ready::new(coincident(130))));
    scenes.push(("mixed", Ready::new(mixed)));
    scenes
}
