//! The generators against the published files: the same objects with the same materials in the
//! same order, and every number equal when printed with six significant digits.
//!
//! With glibc, of which the files were made, all words are equal. Elsewhere `sin`, `exp` and so on
//! may differ in their last bit, which can change a sixth digit and what is left of a rounded-off
//! zero: there up to 0.1 % of the words may be off by one unit of the sixth digit, and numbers
//! below [`ROUNDED_OFF`] count as zero.

mod spd_words;

use flate2::read::GzDecoder;
use libtest_mimic::{Arguments, Failed};
use ropewalk_scene::spd::Spd;
use ropewalk_testkit::data::trial;
use spd_words::each_word;
use std::fs::File;
use std::io::Read;
use std::path::Path;

const FILES: [(Spd, &[u32]); 10] = [
    (Spd::Balls, &[3, 4, 5]),
    (Spd::Gears, &[2, 4]),
    (Spd::Mount, &[4, 6, 8]),
    (Spd::Rings, &[3, 7]),
    (Spd::Teapot, &[4, 6, 12]),
    (Spd::Tetra, &[5, 6]),
    (Spd::Tree, &[8, 11]),
    (Spd::Lattice, &[6, 12]),
    (Spd::Sombrero, &[1]),
    (Spd::Sample, &[1]),
];

fn main() {
    let trials = FILES
        .into_iter()
        .flat_map(|(spd, sizes)| sizes.iter().map(move |&size| (spd, size)))
        .map(|(spd, size)| {
            trial(format!("{spd}_{size}"), &format!("spd/{spd}_{size}.nff.gz"), move |path| {
                compare(spd, size, path)
            })
        })
        .collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit()
}

/// Share of the words that may differ in one unit of the sixth digit.
const TOLERATED: f64 = if cfg!(target_env = "gnu") { 0.0 } else { 1e-3 };

/// Magnitude of what rounding can leave of a zero: a few hundred units of the last place of
/// coordinates of order 1 to 100.
const ROUNDED_OFF: f64 = if cfg!(target_env = "gnu") { 0.0 } else { 1e-12 };

fn compare(spd: Spd, size: u32, path: &Path) -> Result<(), Failed> {
    let mut text = String::new();
    GzDecoder::new(File::open(path)?).read_to_string(&mut text)?;
    let mut published =
        text.lines().flat_map(|line| line.split('#').next().unwrap_or("").split_whitespace());

    let (mut words, mut near, mut wrong) = (0usize, Vec::new(), Vec::new());
    each_word(spd, size, |ours| {
        let theirs = published.next().unwrap_or("the end of the file");
        match agreement(ours, theirs) {
            Agreement::Equal => {}
            Agreement::Near => near.push(format!("word {words}: {ours}, published {theirs}")),
            Agreement::Wrong => wrong.push(format!("word {words}: {ours}, published {theirs}")),
        }
        words += 1;
    });
    let surplus = published.count();
    if let Some(first) = wrong.first() {
        return Err(format!("{} of {words} words differ, first {first}", wrong.len()).into());
    }
    if surplus > 0 {
        return Err(format!("the file goes on for {surplus} words after {words}").into());
    }
    match near.first() {
        Some(first) if near.len() as f64 > TOLERATED * words as f64 => Err(format!(
            "{} of {words} words differ in their last digit, first {first}",
            near.len()
        )
        .into()),
        _ => Ok(()),
    }
}

enum Agreement {
    Equal,
    /// Numbers that differ by at most one unit of the sixth digit.
    Near,
    Wrong,
}

fn agreement(ours: &str, theirs: &str) -> Agreement {
    if ours == theirs {
        return Agreement::Equal;
    }
    let (Ok(a), Ok(b)) = (ours.parse::<f64>(), theirs.parse::<f64>()) else {
        return Agreement::Wrong;
    };
    // One unit of the sixth digit, and a little for the parsing of either number.
    let unit = 10f64.powf(a.abs().log10().floor() - 5.0) * (1.0 + 1e-9);
    if a.abs().max(b.abs()) < ROUNDED_OFF {
        Agreement::Equal
    } else if (a - b).abs() <= unit {
        Agreement::Near
    } else {
        Agreement::Wrong
    }
}
