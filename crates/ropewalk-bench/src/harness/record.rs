//! The record: one CSV row for each scene, workload, engine and number of threads.

use super::engine::Family;
use super::measure::Rate;
use super::verify::Verdict;
use crate::workload::Kind;
use std::io::Write;
use std::path::Path;

/// What one engine did on one workload of one scene.
#[derive(Clone, Debug)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Workload; `None` in the row of a scene that could not be loaded.
    pub workload: Option<Kind>,
    /// Engine or builder.
    pub engine: String,
    /// Whose it is.
    pub family: Family,
    /// SIMD level.
    pub level: String,
    /// Threads.
    pub threads: usize,
    /// Rays of a round, or triangles of a build.
    pub rays: usize,
    /// The rate, if it was measured.
    pub rate: Option<Rate>,
    /// Against the fastest of Embree's plain entry points; of its high-quality build for builds.
    pub ratio_to_best_embree: Option<f64>,
    /// The same against the entry points with the robust flag.
    pub ratio_to_best_robust: Option<f64>,
    /// Against `embree-1`.
    pub ratio_to_embree_1: Option<f64>,
    /// Whether the answers were right.
    pub verdict: Option<Verdict>,
    /// Bytes of the tree with its own triangles, for builds.
    pub bytes_per_triangle: Option<f64>,
    /// What went wrong; such a row takes no part in means.
    pub error: String,
}

impl Row {
    /// The row of something that could not be measured.
    pub fn error(scene: &str, engine: &str, error: impl std::fmt::Display) -> Row {
        Row {
            scene: scene.to_owned(),
            workload: None,
            engine: engine.to_owned(),
            family: Family::Peer,
            level: String::new(),
            threads: 0,
            rays: 0,
            rate: None,
            ratio_to_best_embree: None,
            ratio_to_best_robust: None,
            ratio_to_embree_1: None,
            verdict: None,
            bytes_per_triangle: None,
            error: format!("{error:#}"),
        }
    }

    fn median(&self) -> Option<f64> {
        self.rate.filter(|_| self.error.is_empty()).map(|r| r.spread.median)
    }
}

/// Fills the ratios of rows of one scene, workload and number of threads.
pub(crate) fn fill_ratios(rows: &mut [Row]) {
    let best = |family: Family| {
        let theirs = rows.iter().filter(|r| r.family == family);
        // A medium-quality build is another product than the tree that is traced.
        let theirs = theirs.filter(|r| !r.engine.starts_with("embree-medium"));
        theirs.filter_map(Row::median).reduce(f64::max)
    };
    let (plain, robust) = (best(Family::Embree), best(Family::EmbreeRobust));
    let single = rows.iter().find(|r| r.engine == "embree-1").and_then(Row::median);
    for row in rows {
        let ratio = |to: Option<f64>| Some(row.median()? / to?);
        (row.ratio_to_best_embree, row.ratio_to_best_robust, row.ratio_to_embree_1) =
            (ratio(plain), ratio(robust), ratio(single));
    }
}

/// All rows of a run, and on what they were measured.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// Processor.
    pub cpu: String,
    /// Commit, with `+` if the work tree differs from it.
    pub commit: String,
    /// Everything else that matters.
    pub settings: String,
    /// Rows in the order of measurement.
    pub rows: Vec<Row>,
}

/// The columns.
const COLUMNS: &str = "scene,workload,engine,level,threads,rays,median_mrays,min_mrays,max_mrays,\
    ratio_to_best_embree,ratio_to_best_robust,ratio_to_embree_1,median_wall_mrays,\
    mismatches_per_million,wrong_per_million,bytes_per_triangle,error,cpu,commit,settings";

impl Record {
    /// Appends the rows of one scene, workload and number of threads, with their ratios.
    pub fn add(&mut self, mut rows: Vec<Row>) {
        fill_ratios(&mut rows);
        self.rows.append(&mut rows);
    }

    /// The record as CSV (RFC 4180, line feeds).
    pub fn csv(&self) -> String {
        let mut out = format!("{COLUMNS}\n");
        for row in &self.rows {
            let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.4}"));
            let rate = |f: fn(&Rate) -> f64| number(row.rate.as_ref().map(f));
            let verdict = |f: fn(&Verdict) -> f64| number(row.verdict.as_ref().map(f));
            let fields = [
                row.scene.clone(),
                row.workload.map_or("*", Kind::name).to_owned(),
                row.engine.clone(),
                row.level.clone(),
                row.threads.to_string(),
                row.rays.to_string(),
                rate(|r| r.spread.median),
                rate(|r| r.spread.min),
                rate(|r| r.spread.max),
                number(row.ratio_to_best_embree),
                number(row.ratio_to_best_robust),
                number(row.ratio_to_embree_1),
                rate(|r| r.wall_median),
                verdict(|v| v.mismatches_per_million),
                verdict(|v| v.wrong_per_million),
                number(row.bytes_per_triangle),
                row.error.clone(),
                self.cpu.clone(),
                self.commit.clone(),
                self.settings.clone(),
            ];
            out.push_str(&fields.map(|f| quoted(&f)).join(","));
            out.push('\n');
        }
        out
    }

    /// Writes a file whole or not at all.
    ///
    /// # Errors
    /// If the folder cannot be made or written to.
    pub fn write(path: &Path, text: &str) -> anyhow::Result<()> {
        let folder = path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder)?;
        let temporary = path.with_extension("tmp");
        let mut file = std::fs::File::create(&temporary)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        Ok(std::fs::rename(&temporary, path)?)
    }
}

fn quoted(field: &str) -> String {
    if field.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::Spread;

    fn row(engine: &str, family: Family, median: f64) -> Row {
        let spread = Spread { median, min: median * 0.5, max: median * 2.0 };
        Row {
            workload: Some(Kind::Diffuse),
            family,
            rate: Some(Rate { spread, wall_median: median }),
            ..Row::error("a,b", engine, "")
        }
    }

    fn sample() -> Record {
        let mut record = Record { cpu: "say \"x\"".into(), ..Record::default() };
        record.add(vec![
            row("embree-1", Family::Embree, 2.0),
            row("embree-16", Family::Embree, 4.0),
            row("embree-1-robust", Family::EmbreeRobust, 1.0),
            row("ours", Family::Own, 8.0),
        ]);
        record
    }

    #[test]
    fn ratios_are_against_the_best_of_each_family() {
        let ours = &sample().rows[3];
        assert_eq!(ours.ratio_to_best_embree, Some(2.0));
        assert_eq!(ours.ratio_to_best_robust, Some(8.0));
        assert_eq!(ours.ratio_to_embree_1, Some(4.0));
    }

    #[test]
    fn a_row_with_an_error_has_no_ratio_and_is_no_reference() {
        let mut wrong = row("embree-16", Family::Embree, 9.0);
        wrong.error = "wrong answers".into();
        let mut rows = vec![row("embree-1", Family::Embree, 3.0), wrong];
        fill_ratios(&mut rows);
        assert_eq!((rows[0].ratio_to_best_embree, rows[1].ratio_to_best_embree), (Some(1.0), None));
    }

    #[test]
    fn csv_has_the_columns_and_quotes_what_needs_it() {
        let csv = sample().csv();
        let mut lines = csv.lines();
        let columns = lines.next().unwrap();
        assert!(columns.starts_with(
            "scene,workload,engine,level,threads,rays,median_mrays,min_mrays,max_mrays,\
             ratio_to_best_embree"
        ));
        let first = lines.next().unwrap();
        assert!(first.starts_with("\"a,b\",diffuse,embree-1,,0,0,2.0000,1.0000,4.0000,0.5000,"));
        assert!(first.contains("\"say \"\"x\"\"\""));
        assert_eq!(first.matches(',').count(), columns.matches(',').count() + 1);
        assert_eq!(csv.lines().count(), 5);
    }

    #[test]
    fn files_are_replaced_whole() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a/b.csv");
        Record::write(&path, "one").unwrap();
        Record::write(&path, "two").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(std::fs::read_dir(dir.path().join("a")).unwrap().count(), 1);
    }
}
