//! A chart of lines over a logarithmic axis, as a self-contained SVG.

use std::fmt::Write;

/// One line.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Shown at the line's last point.
    pub name: String,
    /// Any CSS colour.
    pub color: &'static str,
    /// Dashed: something to compare with.
    pub dashed: bool,
    /// Points by ascending `x`, which must be positive.
    pub points: Vec<(f64, f64)>,
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 52.0;
const BOTTOM: f64 = 44.0;
/// Grid lines across.
const LEVELS: usize = 5;
/// Lines of text do not come closer.
const TEXT: f64 = 13.0;

/// The curves over powers of ten on the x axis, linear from 0 on the y axis. Without points the
/// chart is empty.
pub fn curves(title: &str, x_label: &str, y_label: &str, curves: &[Curve]) -> String {
    let points = || curves.iter().flat_map(|c| &c.points);
    let exponents = || points().map(|p| p.0.log10());
    let lo = exponents().fold(f64::INFINITY, f64::min).floor();
    // A little beyond the last point, not a whole power of ten.
    let hi = exponents().fold(f64::NEG_INFINITY, f64::max).max(lo + 1.0) + 0.05;
    let step = nice(points().map(|p| p.1).fold(0.0, f64::max) / LEVELS as f64);
    let x = |v: f64| LEFT + (WIDTH - LEFT - RIGHT) * (v.log10() - lo) / (hi - lo);
    let y = |v: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * v / (step * LEVELS as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n\
         <text x=\"8\" y=\"18\" font-size=\"14\">{title}</text>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{x_label}</text>\n\
         <text x=\"8\" y=\"{:.1}\">{y_label}</text>\n",
        LEFT + (WIDTH - LEFT - RIGHT) / 2.0,
        HEIGHT - 8.0,
        TOP - 14.0
    );
    if lo.is_finite() && step > 0.0 {
        for level in 0..=LEVELS {
            let value = step * level as f64;
            let _ = writeln!(
                svg,
                "<line x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{1:.1}\" y2=\"{1:.1}\" stroke=\"#ddd\"/>\
                 <text x=\"{2:.1}\" y=\"{3:.1}\" text-anchor=\"end\">{value}</text>",
                WIDTH - RIGHT,
                y(value),
                LEFT - 6.0,
                y(value) + 4.0
            );
        }
        for exponent in lo as i32..=hi.floor() as i32 {
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">10<tspan dy=\"-5\" \
                 font-size=\"8\">{exponent}</tspan></text>",
                x(10f64.powi(exponent)),
                HEIGHT - BOTTOM + 16.0
            );
        }
    }
    let mut labels: Vec<(f64, &Curve)> = Vec::new();
    for curve in curves {
        let Some(last) = curve.points.last() else { continue };
        let path: Vec<String> =
            curve.points.iter().map(|p| format!("{:.1},{:.1}", x(p.0), y(p.1))).collect();
        let (width, dashes) = if curve.dashed { (1, " stroke-dasharray=\"4 4\"") } else { (2, "") };
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"{dashes}/>",
            path.join(" "),
            curve.color
        );
        if !curve.dashed {
            for p in &curve.points {
                let (x, y, color) = (x(p.0), y(p.1), curve.color);
                let _ =
                    writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{color}\"/>");
            }
        }
        labels.push((y(last.1), curve));
    }
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = f64::NEG_INFINITY;
    for (at, curve) in labels {
        free = at.max(free + TEXT);
        let (x, y) = (WIDTH - RIGHT + 10.0, free + 4.0);
        let (color, name) = (curve.color, &curve.name);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{color}\">{name}</text>");
    }
    svg + "</svg>\n"
}

/// The next of 1, 2, 2.5, 5 or 10 times a power of ten.
fn nice(step: f64) -> f64 {
    if step <= 0.0 {
        return 0.0;
    }
    let power = 10f64.powf(step.log10().floor());
    let factors = [1.0, 2.0, 2.5, 5.0, 10.0];
    power * factors.into_iter().find(|f| f * power >= step).unwrap_or(10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_all_points_and_labels_keep_apart() {
        assert_eq!([0.7, 3.0, 41.0, 180.0].map(nice), [1.0, 5.0, 50.0, 200.0]);
        let curve = |name: &str, dashed, points: &[(f64, f64)]| Curve {
            name: name.into(),
            color: "#333",
            dashed,
            points: points.to_vec(),
        };
        let data = [
            curve("a", false, &[(1e4, 100.0), (1e7, 240.0)]),
            curve("b", true, &[(1e4, 100.0), (1e7, 241.0)]),
            curve("none", false, &[]),
        ];
        let svg = curves("title", "x", "y", &data);
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains(">250</text>") && !svg.contains("none</text>"), "{svg}");
        let heights: Vec<f64> = ["\"#333\">a<", "\"#333\">b<"]
            .map(|end| {
                let before = &svg[..svg.find(end).unwrap()];
                let at = &before[before.rfind("y=\"").unwrap() + 3..];
                at[..at.find('"').unwrap()].parse().unwrap()
            })
            .to_vec();
        assert!((heights[0] - heights[1]).abs() >= TEXT - 0.1, "{heights:?}");
        assert!(curves("empty", "x", "y", &[]).ends_with("</svg>\n"));
    }
}
