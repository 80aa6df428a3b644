//! What each ingredient is worth, in numbers and in one plain sentence.

use super::model::{MethodResult, Ratios, SceneResult};
use super::published::PAPER_SAVING;
use super::statistics::{geometric_mean, mean};
use ropewalk::method::Method;
use serde::Serialize;

/// A mean within this share of 1 counts as no change.
pub const NO_CHANGE: f64 = 0.02;

/// The direction of a ratio.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Effect {
    /// More than [`NO_CHANGE`] below 1.
    Saves,
    /// Within [`NO_CHANGE`] of 1.
    Nothing,
    /// More than [`NO_CHANGE`] above 1.
    Costs,
}

impl Effect {
    /// The direction of `ratio`.
    pub fn of(ratio: f64) -> Self {
        if ratio < 1.0 - NO_CHANGE {
            Effect::Saves
        } else if ratio > 1.0 + NO_CHANGE {
            Effect::Costs
        } else {
            Effect::Nothing
        }
    }
}

/// A ratio on one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneRatio {
    /// Scene.
    pub scene: String,
    /// Ratio; below 1 is better.
    pub ratio: f64,
}

/// One figure's ratio over the scenes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Arithmetic mean of the ratios.
    pub mean: f64,
    /// Geometric mean of the ratios.
    pub geometric_mean: f64,
    /// Direction of the arithmetic mean.
    pub effect: Effect,
    /// One ratio a scene.
    pub scenes: Vec<SceneRatio>,
}

impl Summary {
    /// Sums up; `None` without scenes.
    pub fn new(scenes: Vec<SceneRatio>) -> Option<Self> {
        if scenes.is_empty() {
            return None;
        }
        let ratios: Vec<_> = scenes.iter().map(|s| s.ratio).collect();
        let mean = mean(&ratios);
        let geometric_mean = geometric_mean(&ratios);
        Some(Summary { mean, geometric_mean, effect: Effect::of(mean), scenes })
    }

    /// The scenes with this effect, furthest from 1 first.
    pub fn with_effect(&self, effect: Effect) -> Vec<&SceneRatio> {
        let mut scenes: Vec<_> =
            self.scenes.iter().filter(|s| Effect::of(s.ratio) == effect).collect();
        let distance = |s: &SceneRatio| s.ratio.ln().abs();
        scenes.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
        scenes
    }
}

/// What one method is worth against the one that it is to be held against.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Method.
    pub method: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Its role.
    pub role: &'static str,
    /// The method it is compared with.
    pub against: &'static str,
    /// Intersection tests and traversal steps.
    pub operations: Option<Summary>,
    /// Rope crossings and rope-tree steps added; only where ropes are walked.
    pub all_steps: Option<Summary>,
    /// Time of a ray.
    pub time: Option<Summary>,
    /// Inner nodes and references.
    pub size: Option<Summary>,
    /// The verdict in words.
    pub sentence: String,
}

impl Verdict {
    /// The figures that are drawn, in order, with their names.
    pub fn figures(&self) -> impl Iterator<Item = (&'static str, &Summary)> {
        [
            ("operations", &self.operations),
            ("all steps", &self.all_steps),
            ("time", &self.time),
            ("size", &self.size),
        ]
        .into_iter()
        .filter_map(|(name, summary)| Some((name, summary.as_ref()?)))
    }
}

/// The method that `method` is held against: an ingredient against the exact sweep to which it was
/// added, ropes on a combined tree against that tree walked from the root, all else against the
/// paper's reference.
pub fn opponent(method: &MethodResult) -> Option<&'static str> {
    match method.role {
        "reference" => None,
        "ingredient" => Some(Method::EXACT),
        "combined" if method.roped => unroped(method.name),
        _ => Some(Method::REFERENCE),
    }
}

/// The name of the same tree walked from the root.
fn unroped(name: &'static str) -> Option<&'static str> {
    name.strip_suffix("-rope-trees").or_else(|| name.strip_suffix("-ropes"))
}

/// The verdicts on all methods but the reference and the naive search, in the order of the report.
pub fn judge(scenes: &[SceneResult]) -> Vec<Verdict> {
    let Some(first) = scenes.first() else { return Vec::new() };
    first
        .methods
        .iter()
        .filter(|m| m.size > 0)
        .filter_map(|m| Some(verdict(m, opponent(m)?, scenes)))
        .collect()
}

fn verdict(method: &MethodResult, against: &'static str, scenes: &[SceneResult]) -> Verdict {
    let figure = |pick: fn(&Ratios) -> Option<f64>| summary(scenes, method.name, against, pick);
    let mut verdict = Verdict {
        method: method.name,
        title: method.title,
        role: method.role,
        against,
        operations: figure(|r| r.operations),
        all_steps: if method.roped { figure(|r| r.all_steps) } else { None },
        time: figure(|r| r.time),
        size: figure(|r| r.size),
        sentence: String::new(),
    };
    verdict.sentence = sentence(&verdict);
    verdict
}

/// The ratio `pick` of `method` to `against` over all scenes that have both.
pub fn summary(
    scenes: &[SceneResult],
    method: &str,
    against: &str,
    pick: fn(&Ratios) -> Option<f64>,
) -> Option<Summary> {
    let ratios = scenes.iter().filter_map(|scene| {
        let ratio = pick(&Ratios::new(scene.method(method)?, scene.method(against)?))?;
        Some(SceneRatio { scene: scene.name.clone(), ratio })
    });
    Summary::new(ratios.collect())
}

/// A ratio from which on it is said as a multiple instead of a percentage.
const MULTIPLE: f64 = 3.0;

/// A ratio as a change in per cent, such as `-12.3 %`, or as a multiple where it is large.
pub fn percent(ratio: f64) -> String {
    let change = 100.0 * (ratio - 1.0);
    if ratio >= MULTIPLE {
        format!("\u{d7}{ratio:.1}")
    } else {
        match format!("{:.1}", change.abs()).as_str() {
            "0.0" => "0.0 %".to_owned(),
            digits if change < 0.0 => format!("\u{2212}{digits} %"),
            digits => format!("+{digits} %"),
        }
    }
}

/// The verdict in words: what is saved, what is not, and where a scene goes the other way.
fn sentence(verdict: &Verdict) -> String {
    let figures: Vec<_> = verdict.figures().collect();
    let listed = |effect| {
        let all = figures.iter().filter(move |(_, s)| s.effect == effect);
        all.map(|(name, s)| match effect {
            Effect::Saves => saved_words(name, s.mean),
            Effect::Costs => paid_words(name, s.mean),
            Effect::Nothing => (*name).to_owned(),
        })
        .collect::<Vec<_>>()
    };
    let (saved, paid, same) =
        (listed(Effect::Saves), listed(Effect::Costs), listed(Effect::Nothing));
    let mut text = match (saved.is_empty(), paid.is_empty()) {
        (true, true) => format!("Brings nothing: {} within 2 %", join(&same)),
        (false, true) => format!("Saves {}", join(&saved)),
        (true, false) => format!("Saves nothing and costs {}", join(&paid)),
        (false, false) => format!("Saves {}, but costs {}", join(&saved), join(&paid)),
    };
    let changed = !saved.is_empty() || !paid.is_empty();
    if changed && !same.is_empty() {
        text += &format!("; {} unchanged", join(&same));
    }
    text.push('.');
    for (name, summary) in &figures {
        text += &exceptions(name, summary);
    }
    text
}

/// The scenes that go against the mean: losses where it saves or does nothing, gains where it
/// costs; the three furthest by name.
fn exceptions(name: &str, summary: &Summary) -> String {
    const NAMED: usize = 3;
    let (word, against) = match summary.effect {
        Effect::Costs => ("Gains", Effect::Saves),
        Effect::Saves | Effect::Nothing => ("Loses", Effect::Costs),
    };
    let scenes = summary.with_effect(against);
    if scenes.is_empty() {
        return String::new();
    }
    let mut list: Vec<_> =
        scenes.iter().take(NAMED).map(|s| format!("{} ({})", s.scene, percent(s.ratio))).collect();
    if scenes.len() > NAMED {
        list.push(format!("{} more", scenes.len() - NAMED));
    }
    format!(" {word} in {name} on {}.", join(&list))
}

fn saved_words(name: &str, ratio: f64) -> String {
    let share = format!("{:.1} %", 100.0 * (1.0 - ratio));
    if name == "all steps" {
        format!("{share} of all steps")
    } else {
        format!("{share} of the {name}")
    }
}

fn paid_words(name: &str, ratio: f64) -> String {
    let share = format!("{:.1} %", 100.0 * (ratio - 1.0));
    match name {
        "size" if ratio >= MULTIPLE => format!("a tree {ratio:.1} times as large"),
        "size" => format!("a tree {share} larger"),
        _ if ratio >= MULTIPLE => format!("{ratio:.1} times the {name}"),
        "all steps" => format!("{share} more steps in all"),
        _ => format!("{share} more {name}"),
    }
}

/// `a`, `a and b`, `a, b and c`.
fn join(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

/// The claim of the paper beside what was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Headline {
    /// The combination against the reference.
    pub combined: Option<HeadlineFigures>,
    /// The combination against the exact sweep.
    pub combined_to_exact: Option<HeadlineFigures>,
    /// The combination walked along rope trees, against the reference.
    pub combined_rope_trees: Option<HeadlineFigures>,
    /// The best tree against the reference.
    pub best: Option<HeadlineFigures>,
    /// What the paper says it saves of the operations, smallest and largest.
    pub paper_saving: [f64; 2],
    /// The headline in words.
    pub sentence: String,
}

/// Means over the scenes.
#[derive(Clone, Debug, Serialize)]
pub struct HeadlineFigures {
    /// Intersection tests and traversal steps.
    pub operations: Summary,
    /// Operations, rope crossings and steps in rope trees.
    pub all_steps: Summary,
    /// Time of a ray.
    pub time: Summary,
    /// Inner nodes and references.
    pub size: Summary,
}

impl Headline {
    /// From all scenes.
    pub fn new(scenes: &[SceneResult]) -> Self {
        let against = |method: &str, against: &str| {
            Some(HeadlineFigures {
                operations: summary(scenes, method, against, |r| r.operations)?,
                all_steps: summary(scenes, method, against, |r| r.all_steps)?,
                time: summary(scenes, method, against, |r| r.time)?,
                size: summary(scenes, method, against, |r| r.size)?,
            })
        };
        let mut headline = Headline {
            combined: against("combined", Method::REFERENCE),
            combined_to_exact: against("combined", Method::EXACT),
            combined_rope_trees: against("combined-rope-trees", Method::REFERENCE),
            best: against(Method::DEFAULT, Method::REFERENCE),
            paper_saving: [*PAPER_SAVING.start(), *PAPER_SAVING.end()],
            sentence: String::new(),
        };
        headline.sentence = headline.words();
        headline
    }

    /// Each row of the means with its name.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, &HeadlineFigures)> {
        [
            ("combined / reference", &self.combined),
            ("combined / exact sweep", &self.combined_to_exact),
            ("combined-rope-trees / reference", &self.combined_rope_trees),
            ("best / reference", &self.best),
        ]
        .into_iter()
        .filter_map(|(name, figures)| Some((name, figures.as_ref()?)))
    }

    fn words(&self) -> String {
        let Some(combined) = &self.combined else { return String::new() };
        let mut text = claim(combined);
        if let Some(to_exact) = &self.combined_to_exact {
            text += &format!(
                " Against the exact sweep of the same measure it needs {}.",
                change(&to_exact.operations, "fewer operations", "more operations")
            );
        }
        if let Some(ropes) = &self.combined_rope_trees {
            text += &format!(
                " Along rope trees it makes {}, links and their trees counted, and a ray takes {}.",
                change(&ropes.all_steps, "fewer steps in all", "more steps in all"),
                change(&ropes.time, "less time", "more time")
            );
        }
        text
    }
}

/// `12.3 % fewer operations`.
fn change(summary: &Summary, less: &str, more: &str) -> String {
    let share = summary.mean - 1.0;
    format!("{:.1} % {}", 100.0 * share.abs(), if share <= 0.0 { less } else { more })
}

fn claim(figures: &HeadlineFigures) -> String {
    let saved = 1.0 - figures.operations.mean;
    let place = match &figures.operations.scenes[..] {
        [one] => format!("on {}", one.scene),
        many => format!("on the mean of {} scenes", many.len()),
    };
    let range = if saved < *PAPER_SAVING.start() {
        "less than the 20 to 38 % of the paper"
    } else if saved > *PAPER_SAVING.end() {
        "more than the 20 to 38 % of the paper"
    } else {
        "inside the 20 to 38 % of the paper"
    };
    format!(
        "Built with all ingredients and walked from the root, a tree needs {} than the reference \
         {place}: {range}. A ray takes {}, and the tree is {}.",
        change(&figures.operations, "fewer operations", "more operations"),
        change(&figures.time, "less time", "more time"),
        change(&figures.size, "smaller", "larger"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::sample;

    fn ratios(list: &[(&str, f64)]) -> Option<Summary> {
        let scene_ratio = |&(scene, ratio): &(&str, f64)| SceneRatio { scene: scene.into(), ratio };
        Summary::new(list.iter().map(scene_ratio).collect())
    }

    fn words(operations: f64, time: f64, size: f64) -> String {
        let one = |ratio| ratios(&[("balls", ratio)]);
        let verdict = Verdict {
            method: "m",
            title: "t",
            role: "ingredient",
            against: Method::EXACT,
            operations: one(operations),
            all_steps: None,
            time: one(time),
            size: one(size),
            sentence: String::new(),
        };
        sentence(&verdict)
    }

    #[test]
    fn two_per_cent_is_nothing() {
        for ratio in [0.98, 1.0, 1.02, 0.981, 1.019] {
            assert_eq!(Effect::of(ratio), Effect::Nothing, "{ratio}");
        }
        assert_eq!(Effect::of(0.979), Effect::Saves);
        assert_eq!(Effect::of(1.021), Effect::Costs);
    }

    #[test]
    fn wording() {
        assert_eq!(words(1.0, 0.99, 1.01), "Brings nothing: operations, time and size within 2 %.");
        assert_eq!(
            words(0.877, 0.96, 1.0),
            "Saves 12.3 % of the operations and 4.0 % of the time; size unchanged."
        );
        assert_eq!(
            words(0.9, 1.0, 1.5),
            "Saves 10.0 % of the operations, but costs a tree 50.0 % larger; time unchanged."
        );
        assert_eq!(
            words(1.1, 1.2, 1.3),
            "Saves nothing and costs 10.0 % more operations, 20.0 % more time and a tree 30.0 % larger."
        );
    }

    #[test]
    fn scenes_against_the_mean_are_named_furthest_first() {
        let mixed = ratios(&[("balls", 0.7), ("tree", 1.03), ("tetra", 1.1), ("rings", 1.01)]);
        assert_eq!(
            exceptions("operations", &mixed.unwrap()),
            " Loses in operations on tetra (+10.0 %) and tree (+3.0 %)."
        );
        let many = [("a", 0.1), ("b", 1.1), ("c", 1.2), ("d", 1.3), ("e", 1.15)];
        assert_eq!(
            exceptions("time", &ratios(&many).unwrap()),
            " Loses in time on d (+30.0 %), c (+20.0 %), e (+15.0 %) and 1 more."
        );
        let costs = ratios(&[("balls", 1.3), ("tree", 0.9)]).unwrap();
        assert_eq!(exceptions("time", &costs), " Gains in time on tree (\u{2212}10.0 %).");
        let none = ratios(&[("balls", 1.02), ("tree", 0.5)]).unwrap();
        assert_eq!(exceptions("time", &none), "");
    }

    #[test]
    fn large_ratios_are_multiples() {
        assert_eq!([1.0, 0.9996, 1.0004].map(percent), ["0.0 %"; 3]);
        assert_eq!(percent(0.95), "\u{2212}5.0 %");
        assert_eq!(percent(2.99), "+199.0 %");
        assert_eq!(percent(23.18), "\u{d7}23.2");
        assert_eq!(
            words(23.18, 4.0, 5.0),
            "Saves nothing and costs 23.2 times the operations, 4.0 times the time and a tree 5.0 \
             times as large."
        );
    }

    #[test]
    fn each_method_has_its_opponent() {
        let scenes = sample::scenes(2);
        let verdicts = judge(&scenes);
        let against = |name: &str| verdicts.iter().find(|v| v.method == name).map(|v| v.against);
        assert_eq!(against("termination"), Some(Method::EXACT));
        assert_eq!(against(Method::EXACT), Some(Method::REFERENCE));
        assert_eq!(against("combined"), Some(Method::REFERENCE));
        assert_eq!(against("combined-ropes"), Some("combined"));
        assert_eq!(against("combined-rope-trees"), Some("combined"));
        assert!(verdicts.iter().all(|v| scenes[0].method(v.against).is_some()));
        assert_eq!(against(Method::REFERENCE), None);
        assert_eq!(against("naive"), None);
        assert!(verdicts.iter().all(|v| v.all_steps.is_some() == v.method.contains("rope")));
    }

    #[test]
    fn the_headline_names_its_place_in_the_paper_s_range() {
        let figures = |ratio| {
            let one = || ratios(&[("balls", ratio), ("tree", ratio)]).unwrap();
            HeadlineFigures { operations: one(), all_steps: one(), time: one(), size: one() }
        };
        assert!(claim(&figures(0.7)).contains("30.0 % fewer operations"));
        assert!(claim(&figures(0.7)).contains("inside the 20 to 38 %"));
        assert!(claim(&figures(0.9)).contains("less than the 20 to 38 %"));
        assert!(claim(&figures(0.5)).contains("more than the 20 to 38 %"));
        assert!(claim(&figures(1.2)).contains("20.0 % larger"));
        let headline = Headline::new(&sample::scenes(3));
        assert!(headline.sentence.contains("on the mean of 3 scenes"));
        assert!(
            headline.sentence.contains("exact sweep") && headline.sentence.contains("steps in all")
        );
        assert_eq!(headline.rows().count(), 4);
    }
}
