//! The charts of the report.

use super::scale::{LogScale, tick_label};
use super::svg::{Anchor, Svg};
use crate::paper::verdict::{Effect, SceneRatio, Summary, percent};

/// Width of a chart in user units: that of a phone, so that its text is readable there.
const WIDTH: f64 = 340.0;
/// An axis of strips: ratios from `1 / reach` to `reach`, with these marked.
pub struct StripAxis {
    reach: f64,
    ticks: &'static [f64],
}

/// From the closest look to the widest.
const STRIP_AXES: [StripAxis; 3] = [
    StripAxis { reach: 1.3, ticks: &[0.8, 0.9, 1.0, 1.1, 1.25] },
    StripAxis { reach: 1.75, ticks: &[0.6, 0.8, 1.0, 1.25, 1.6] },
    StripAxis { reach: 2.6, ticks: &[0.4, 0.6, 1.0, 1.6, 2.5] },
];

/// Share of the ratios that must lie on a common axis; the others sit on its edge.
const ON_AXIS: f64 = 0.8;

impl StripAxis {
    /// The closest look that holds most of the ratios.
    pub fn for_ratios<'a>(summaries: impl Iterator<Item = &'a Summary>) -> &'static StripAxis {
        let distances: Vec<_> =
            summaries.flat_map(|s| &s.scenes).map(|s| s.ratio.ln().abs().exp()).collect();
        let holds = |axis: &&StripAxis| {
            let inside = distances.iter().filter(|d| **d <= axis.reach).count();
            inside as f64 >= ON_AXIS * distances.len() as f64
        };
        STRIP_AXES.iter().find(holds).unwrap_or(&STRIP_AXES[STRIP_AXES.len() - 1])
    }
}

fn effect_class(effect: Effect) -> &'static str {
    match effect {
        Effect::Saves => "good",
        Effect::Costs => "bad",
        Effect::Nothing => "same",
    }
}

/// One strip a figure: a dot a scene, the mean as a bar, a line where nothing changes.
pub fn strips(figures: &[(&'static str, &Summary)], axis: &StripAxis, label: &str) -> String {
    const ROW: f64 = 30.0;
    const LEFT: f64 = 82.0;
    const RIGHT: f64 = WIDTH - 68.0;
    let bottom = 6.0 + ROW * figures.len() as f64;
    let mut svg = Svg::new(WIDTH, bottom + 20.0, label);
    let scale = LogScale::new(1.0 / axis.reach, axis.reach, LEFT, RIGHT);
    for &tick in axis.ticks {
        let class = if tick == 1.0 { "one" } else { "grid" };
        svg.line(class, [scale.at(tick), 4.0], [scale.at(tick), bottom]);
        svg.text("tick", [scale.at(tick), bottom + 14.0], Anchor::Middle, &tick_label(tick));
    }
    for (i, (name, summary)) in figures.iter().enumerate() {
        let y = 6.0 + ROW * (i as f64 + 0.5);
        svg.text("row", [LEFT - 14.0, y + 4.0], Anchor::End, name);
        for SceneRatio { scene, ratio } in &summary.scenes {
            let tip = format!("{scene}: {ratio:.3}");
            svg.dot("scene", [scale.at(*ratio), y], 4.5, &tip);
        }
        let class = effect_class(summary.effect);
        let x = scale.at(summary.mean);
        let tip = format!("mean of {name}: {:.3}", summary.mean);
        svg.rect(&format!("mean {class}"), [x - 2.0, y - 10.0], [4.0, 20.0], &tip);
        let place = [WIDTH - 2.0, y + 4.0];
        svg.text(&format!("value {class}"), place, Anchor::End, &percent(summary.mean));
    }
    svg.finish()
}

/// Bars of ratios, one group a scene; `series` holds a name and its ratios, three at most.
pub fn scene_bars(series: &[(&str, &Summary)], figure: &str) -> String {
    const BAR: f64 = 11.0;
    const LEFT: f64 = 62.0;
    const RIGHT: f64 = WIDTH - 46.0;
    let Some((_, first)) = series.first() else { return String::new() };
    let group = BAR * series.len() as f64 + 10.0;
    let legend = 8.0 + 17.0 * series.len() as f64;
    let bottom = legend + group * first.scenes.len() as f64;
    let largest =
        series.iter().flat_map(|(_, s)| &s.scenes).fold(1.0f64, |largest, s| largest.max(s.ratio));
    let at = |ratio: f64| LEFT + (RIGHT - LEFT) * ratio / largest;
    let mut svg = Svg::new(WIDTH, bottom + 36.0, &format!("{figure} of each scene, reference = 1"));
    for (i, (name, summary)) in series.iter().enumerate() {
        let y = 5.0 + 17.0 * i as f64;
        svg.rect(&format!("series{i}"), [0.0, y], [12.0, 10.0], name);
        let text = format!("{name}, mean {:.3}", summary.mean);
        svg.text("row", [18.0, y + 9.0], Anchor::Start, &text);
    }
    let step = if largest > 2.0 { 0.5 } else { 0.25 };
    for i in 0..=(largest / step) as usize {
        let ratio = i as f64 * step;
        let class = if ratio == 1.0 { "one" } else { "grid" };
        svg.line(class, [at(ratio), legend], [at(ratio), bottom]);
        svg.text("tick", [at(ratio), bottom + 14.0], Anchor::Middle, &tick_label(ratio));
    }
    let middle = [(LEFT + RIGHT) / 2.0, bottom + 31.0];
    svg.text("axis", middle, Anchor::Middle, &format!("{figure}, reference = 1"));
    for (g, SceneRatio { scene, .. }) in first.scenes.iter().enumerate() {
        let top = legend + group * g as f64 + 5.0;
        let middle = top + BAR * series.len() as f64 / 2.0;
        svg.text("row", [LEFT - 8.0, middle + 4.0], Anchor::End, scene);
        for (i, (name, summary)) in series.iter().enumerate() {
            let Some(SceneRatio { ratio, .. }) = summary.scenes.get(g) else { continue };
            let y = top + BAR * i as f64;
            let tip = format!("{scene}, {name}: {ratio:.3}");
            let class = format!("series{i}");
            svg.rect(&class, [LEFT, y], [at(*ratio) - LEFT, BAR - 2.0], &tip);
            let place = [at(*ratio) + 4.0, y + BAR - 2.5];
            svg.text("tick", place, Anchor::Start, &format!("{ratio:.2}"));
        }
    }
    svg.finish()
}

/// A point of a scatter or line chart.
pub struct Point {
    /// Horizontal value, positive.
    pub x: f64,
    /// Vertical value, positive.
    pub y: f64,
    /// Tooltip.
    pub tip: String,
}

/// Points of one kind.
pub struct Series {
    /// Name in the legend.
    pub name: &'static str,
    /// Its points.
    pub points: Vec<Point>,
    /// True if a line joins them.
    pub joined: bool,
}

/// What stands around the points.
pub struct Frame<'a> {
    /// What the chart shows, in words.
    pub label: &'a str,
    /// Title of the x axis.
    pub x_title: &'a str,
    /// Title of the y axis.
    pub y_title: &'a str,
    /// True if both axes have one range and a diagonal.
    pub square: bool,
    /// Lines through the given points, named in the tooltip only by the caption.
    pub guides: Vec<Vec<[f64; 2]>>,
}

/// A chart with two logarithmic axes.
pub fn log_log(frame: &Frame<'_>, series: &[Series]) -> String {
    const LEFT: f64 = 52.0;
    const RIGHT: f64 = WIDTH - 10.0;
    const PLOT: f64 = 250.0;
    let legend = 6.0 + 17.0 * series.len() as f64;
    let bottom = legend + PLOT;
    let mut svg = Svg::new(WIDTH, bottom + 40.0, frame.label);
    for (i, s) in series.iter().enumerate() {
        let y = 9.0 + 17.0 * i as f64;
        svg.dot(&format!("series{i}"), [6.0, y], 4.5, s.name);
        svg.text("row", [16.0, y + 4.0], Anchor::Start, s.name);
    }
    let points = || series.iter().flat_map(|s| &s.points);
    let both = |p: &Point| if frame.square { [p.x, p.y] } else { [p.x, p.x] };
    let both_y = |p: &Point| if frame.square { [p.x, p.y] } else { [p.y, p.y] };
    let xs = LogScale::around(points().flat_map(both), LEFT, RIGHT);
    let ys = LogScale::around(points().flat_map(both_y), bottom, legend);
    for tick in xs.ticks() {
        svg.line("grid", [xs.at(tick), legend], [xs.at(tick), bottom]);
        svg.text("tick", [xs.at(tick), bottom + 14.0], Anchor::Middle, &tick_label(tick));
    }
    for tick in ys.ticks() {
        svg.line("grid", [LEFT, ys.at(tick)], [RIGHT, ys.at(tick)]);
        svg.text("tick", [LEFT - 5.0, ys.at(tick) + 4.0], Anchor::End, &tick_label(tick));
    }
    svg.text("axis", [(LEFT + RIGHT) / 2.0, bottom + 32.0], Anchor::Middle, frame.x_title);
    svg.axis_title([12.0, (legend + bottom) / 2.0], frame.y_title);
    if frame.square {
        svg.line("one", [LEFT, bottom], [RIGHT, legend]);
    }
    for guide in &frame.guides {
        let line: Vec<_> = guide.iter().map(|[x, y]| [xs.at(*x), ys.at(*y)]).collect();
        svg.polyline("guide", &line);
    }
    for (i, s) in series.iter().enumerate() {
        let place = |p: &Point| [xs.at(p.x), ys.at(p.y)];
        if s.joined {
            let line: Vec<_> = s.points.iter().map(place).collect();
            svg.polyline(&format!("line{i}"), &line);
        }
        for p in &s.points {
            svg.dot(&format!("series{i}"), place(p), 4.0, &p.tip);
        }
    }
    svg.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::report::html::check_balance;

    fn summary(ratios: &[f64]) -> Summary {
        let one = |(i, &ratio): (usize, &f64)| SceneRatio { scene: format!("s{i}"), ratio };
        Summary::new(ratios.iter().enumerate().map(one).collect()).unwrap()
    }

    #[test]
    fn strips_mark_each_scene_and_stay_inside() {
        let summary = summary(&[0.01, 0.9, 1.0, 50.0]);
        let svg = strips(&[("operations", &summary)], &STRIP_AXES[0], "label");
        check_balance(&svg).unwrap();
        assert_eq!(svg.matches("class=\"scene\"").count(), 4);
        for part in svg.split("cx=\"").skip(1) {
            let x: f64 = part.split('"').next().unwrap().parse().unwrap();
            assert!((0.0..=WIDTH).contains(&x));
        }
    }

    #[test]
    fn bars_have_a_group_a_scene() {
        let (a, b) = (summary(&[0.5, 0.7]), summary(&[0.9, 3.0]));
        let svg = scene_bars(&[("a", &a), ("b", &b)], "label");
        check_balance(&svg).unwrap();
        assert_eq!(svg.matches("class=\"series1\"").count(), 3); // two bars and the legend
        assert_eq!(scene_bars(&[], ""), "");
    }

    #[test]
    fn a_log_chart_survives_one_point_and_none() {
        let frame =
            Frame { label: "l", x_title: "x", y_title: "y", square: true, guides: Vec::new() };
        for points in [vec![], vec![Point { x: 3.0, y: 4.0, tip: "t".into() }]] {
            let svg = log_log(&frame, &[Series { name: "s", points, joined: true }]);
            check_balance(&svg).unwrap();
            assert!(!svg.contains("NaN"));
        }
    }
}
