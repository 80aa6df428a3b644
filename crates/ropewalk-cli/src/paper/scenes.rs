//! The scenes of the experiment and their sizes.

use clap::ValueEnum;

/// How large the scenes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Size {
    /// About 500 to 1,300 objects
    Small,
    /// The database's standard, 4,096 to 9,345 objects
    Standard,
    /// About ten times the standard
    Large,
}

impl Size {
    /// Name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Size::Small => "small",
            Size::Standard => "standard",
            Size::Large => "large",
        }
    }
}

/// A scene of the databases and its size factors, small, standard and large.
struct Row {
    name: &'static str,
    factors: [u32; 3],
}

const ROWS: [Row; 8] = [
    Row { name: "balls", factors: [3, 4, 5] },
    Row { name: "gears", factors: [2, 4, 9] },
    Row { name: "lattice", factors: [6, 12, 26] },
    Row { name: "mount", factors: [4, 6, 8] },
    Row { name: "rings", factors: [3, 7, 15] },
    Row { name: "teapot", factors: [4, 12, 40] },
    Row { name: "tetra", factors: [5, 6, 8] },
    Row { name: "tree", factors: [8, 11, 14] },
];

/// Number of scenes in the whole experiment.
pub const SCENE_COUNT: usize = ROWS.len();

/// A scene at a size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneChoice {
    /// Name in the databases.
    pub name: &'static str,
    /// Size factor.
    pub factor: u32,
}

impl SceneChoice {
    /// The built-in scene's name, such as `spd:balls:4`.
    pub fn spec(&self) -> String {
        format!("spd:{}:{}", self.name, self.factor)
    }
}

/// The scenes called `names` in the order of the databases, each once; all if `names` is empty.
///
/// # Errors
/// A sentence that names the unknown scene and lists the known ones.
pub fn choose(names: &[String], size: Size) -> Result<Vec<SceneChoice>, String> {
    let known = |name: &str| name == "all" || ROWS.iter().any(|row| row.name == name);
    if let Some(unknown) = names.iter().find(|name| !known(name)) {
        let list = ROWS.map(|row| row.name).join(", ");
        return Err(format!(
            "no scene of the experiment is called '{unknown}'; scenes are: {list}"
        ));
    }
    let all = names.is_empty() || names.iter().any(|name| name == "all");
    let wanted = ROWS.iter().filter(|row| all || names.iter().any(|name| name == row.name));
    Ok(wanted
        .map(|row| SceneChoice { name: row.name, factor: row.factors[size as usize] })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_ordered_and_unique() {
        let names = ["tree", "balls", "tree"].map(str::to_owned);
        let chosen = choose(&names, Size::Large).unwrap();
        assert_eq!(
            chosen.iter().map(SceneChoice::spec).collect::<Vec<_>>(),
            ["spd:balls:5", "spd:tree:14"]
        );
        assert_eq!(choose(&[], Size::Standard).unwrap().len(), SCENE_COUNT);
        assert_eq!(choose(&["all".to_owned()], Size::Small).unwrap()[2].spec(), "spd:lattice:6");
    }

    #[test]
    fn an_unknown_scene_is_named_with_the_known_ones() {
        let message = choose(&["ball".to_owned()], Size::Small).unwrap_err();
        assert!(message.contains("'ball'") && message.contains("balls, gears"), "{message}");
    }

    #[test]
    fn every_scene_has_published_figures() {
        for row in &ROWS {
            assert!(crate::paper::published::efficiency(row.name).is_some(), "{}", row.name);
        }
    }
}
