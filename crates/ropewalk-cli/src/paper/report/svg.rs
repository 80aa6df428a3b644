//! A small writer of inline SVG. Colours come from classes of the page's style sheet.

use super::html::escape;
use std::fmt::Write;

/// Where a text stands against its point.
#[derive(Clone, Copy)]
pub enum Anchor {
    /// Begins there.
    Start,
    /// Is centred there.
    Middle,
    /// Ends there.
    End,
}

/// A drawing in user units; on a wide enough screen a unit is a pixel.
pub struct Svg {
    width: f64,
    height: f64,
    label: String,
    body: String,
}

impl Svg {
    /// An empty drawing; `label` says in words what it shows.
    pub fn new(width: f64, height: f64, label: &str) -> Self {
        Svg { width, height, label: escape(label), body: String::new() }
    }

    /// A straight line.
    pub fn line(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        let ([x1, y1], [x2, y2]) = (from, to);
        self.put(format_args!(
            "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>\n"
        ));
    }

    /// An open line through points.
    pub fn polyline(&mut self, class: &str, points: &[[f64; 2]]) {
        let list: Vec<_> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let list = list.join(" ");
        self.put(format_args!("<polyline class=\"{class}\" points=\"{list}\"/>\n"));
    }

    /// A rectangle with a tooltip.
    pub fn rect(&mut self, class: &str, at: [f64; 2], size: [f64; 2], tip: &str) {
        let ([x, y], [w, h]) = (at, size);
        self.put(format_args!(
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" \
             rx=\"2\"><title>{}</title></rect>\n",
            escape(tip)
        ));
    }

    /// A dot with a tooltip.
    pub fn dot(&mut self, class: &str, at: [f64; 2], radius: f64, tip: &str) {
        let [x, y] = at;
        self.put(format_args!(
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{}</title>\
             </circle>\n",
            escape(tip)
        ));
    }

    /// A text.
    pub fn text(&mut self, class: &str, at: [f64; 2], anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.put(format_args!(
            "<text class=\"{class}\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>\n",
            at[0],
            at[1],
            escape(text)
        ));
    }

    /// A text that runs upwards along the y axis, centred at `at`.
    pub fn axis_title(&mut self, at: [f64; 2], text: &str) {
        let [x, y] = at;
        self.put(format_args!(
            "<text class=\"axis\" transform=\"translate({x:.1} {y:.1}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>\n",
            escape(text)
        ));
    }

    /// The element.
    pub fn finish(self) -> String {
        let Svg { width, height, label, body } = self;
        format!(
            "<svg viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{width:.0}px\" \
             role=\"img\" aria-label=\"{label}\">\n{body}</svg>\n"
        )
    }

    fn put(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = self.body.write_fmt(element); // a String takes everything
    }
}
