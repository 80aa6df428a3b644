//! Altered scenes that pass: no query may leave the bytes, panic or go on forever.

use crate::property::{opens_or_refuses, repair};
use crate::scenes::{Ready, all, coincident, soup};
use ropewalk::file::HEADER_BYTES;
use ropewalk_testkit::rays::Draw;

/// Numbers that are likely to do harm.
const WORDS: [u32; 12] = [
    0,
    1,
    u32::MAX,
    0x7FC0_0000, // NaN
    0x7F80_0000, // infinity
    0xFF80_0000,
    0x7F7F_FFFF, // the largest number
    0x0000_0001, // the smallest
    0x8000_0000,
    (1 << 30) - 1,
    1 << 29,
    0x3F80_0000,
];

fn alter(bytes: &mut [u8], draw: &mut Draw) {
    for _ in 0..1 + draw.below(8) {
        // Beyond the header, whose checks have tests of their own.
        let at = HEADER_BYTES + draw.below(bytes.len() - HEADER_BYTES);
        match draw.below(3) {
            0 => bytes[at] ^= 1 << draw.below(8),
            1 => bytes[at] = draw.bits() as u8,
            _ => {
                let at = at / 4 * 4;
                bytes[at..at + 4].copy_from_slice(&WORDS[draw.below(WORDS.len())].to_le_bytes());
            }
        }
    }
}

#[test]
fn flipped_bytes_harm_nobody() {
    let mut opened = 0;
    for (seed, (name, ready)) in all().into_iter().enumerate() {
        let bytes = ready.bytes();
        for round in 0..60 {
            let mut draw = Draw::new(1000 * seed as u64 + round);
            let mut bytes = bytes.clone();
            alter(&mut bytes, &mut draw);
            if draw.chance(0.1) {
                bytes.truncate(draw.below(bytes.len()));
            }
            repair(&mut bytes);
            if opens_or_refuses(&bytes) {
                opened += usize::from(name != "empty");
            }
        }
    }
    assert!(opened > 100, "too few are opened to say anything: {opened}");
}

/// Every number of every block, one kind of harm after the other: links stay as they are.
#[test]
fn blocks_of_nonsense_harm_nobody() {
    let blocks = |bytes: &mut [u8], word: &mut dyn FnMut(usize) -> Option<u32>| {
        let scene =
            ropewalk::file::open(&crate::property::shared(bytes), ropewalk::file::Check::Structure)
                .unwrap();
        let tree = scene.sections[0].range();
        let mut codes = vec![scene.tree.root()];
        while let Some(code) = codes.pop() {
            if code & ropewalk::wide::LEAF == 0 && code != 0 {
                codes.extend(scene.tree.lines().treelet(ropewalk::wide::code_line(code)).child);
            } else if code != 0 {
                for line in scene.tree.block_lines(code) {
                    for i in 0..80 {
                        if let Some(word) = word(i) {
                            let at = tree.start + line * 64 + 4 * i;
                            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
                        }
                    }
                }
            }
        }
    };
    for geometry in [soup(300, 11, true), coincident(200)] {
        let bytes = Ready::new(geometry).bytes();
        // Ids are the last eight of the eighty words of a block.
        for first in [0, 72] {
            for &value in &WORDS {
                for share in [0.1, 1.0] {
                    let (mut bytes, mut draw) = (bytes.clone(), Draw::new(u64::from(value)));
                    blocks(&mut bytes, &mut |i| {
                        (i >= first && draw.chance(share)).then_some(value)
                    });
                    repair(&mut bytes);
                    assert!(opens_or_refuses(&bytes), "{value:#x}");
                }
            }
        }
        for seed in 0..8 {
            let (mut bytes, mut draw) = (bytes.clone(), Draw::new(seed));
            blocks(&mut bytes, &mut |_| Some(draw.bits() as u32));
            repair(&mut bytes);
            assert!(opens_or_refuses(&bytes), "{seed}");
        }
    }
}

/// Planes anywhere.
#[test]
fn planes_of_nonsense_harm_nobody() {
    let bytes = Ready::new(soup(400, 12, false)).bytes();
    let scene =
        ropewalk::file::open(&crate::property::shared(&bytes), ropewalk::file::Check::Structure)
            .unwrap();
    let tree = scene.sections[0].range();
    for seed in 0..40 {
        let (mut bytes, mut draw) = (bytes.clone(), Draw::new(seed));
        let mut codes = vec![scene.tree.root()];
        while let Some(code) = codes.pop() {
            if code == 0 || code & ropewalk::wide::LEAF != 0 {
                continue;
            }
            let line = ropewalk::wide::code_line(code);
            codes.extend(scene.tree.lines().treelet(line).child);
            for h in 0..7 {
                let mut word = WORDS[draw.below(WORDS.len())];
                if seed % 2 == 0 {
                    word = draw.bits() as u32;
                }
                if !f32::from_bits(word).is_nan() {
                    let at = tree.start + line * 64 + 4 * h;
                    bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
                }
            }
        }
        repair(&mut bytes);
        assert!(opens_or_refuses(&bytes), "{seed}");
    }
}
