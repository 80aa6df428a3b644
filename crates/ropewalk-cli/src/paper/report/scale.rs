//! From values to places on an axis.

/// A logarithmic axis.
#[derive(Clone, Copy, Debug)]
pub struct LogScale {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl LogScale {
    /// Puts `low ..= high` on `start ..= end`; both values positive, `low < high`.
    pub fn new(low: f64, high: f64, start: f64, end: f64) -> Self {
        LogScale { low, high, start, end }
    }

    /// An axis around positive values with a tenth of a decade to spare on either side.
    pub fn around(values: impl IntoIterator<Item = f64>, start: f64, end: f64) -> Self {
        let (low, high) = values
            .into_iter()
            .filter(|v| *v > 0.0 && v.is_finite())
            .fold((f64::INFINITY, 0.0f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (1.0, 10.0) };
        let spare = 10f64.powf(0.1);
        LogScale::new(low / spare, high * spare, start, end)
    }

    /// The place of `value`, held inside the axis.
    pub fn at(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.start + share.clamp(0.0, 1.0) * (self.end - self.start)
    }

    /// True if `value` lies on the axis.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Round values on the axis: 1, 2 and 5 of each decade, more where the axis is short, and the
    /// decades alone where it spans more than two.
    pub fn ticks(&self) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let steps: &[f64] = match self.high / self.low {
            span if span > 100.0 => &[1.0],
            span if span > 6.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        };
        let all = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
        all.filter(|t| self.contains(*t)).collect()
    }
}

/// A tick's label: 0.05, 0.5, 5, 50, 5k, 5M.
pub fn tick_label(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{}M", round(v / 1e6)),
        v if v >= 1e3 => format!("{}k", round(v / 1e3)),
        v => round(v),
    }
}

/// The shortest decimal with at most four digits after the point.
fn round(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle() {
        let scale = LogScale::new(1.0, 100.0, 10.0, 210.0);
        assert_eq!((scale.at(1.0), scale.at(10.0), scale.at(100.0)), (10.0, 110.0, 210.0));
        assert_eq!((scale.at(0.5), scale.at(1e9)), (10.0, 210.0));
    }

    #[test]
    fn ticks_are_round_and_on_the_axis() {
        assert_eq!(LogScale::new(0.9, 60.0, 0.0, 1.0).ticks(), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(LogScale::new(14.0, 45.0, 0.0, 1.0).ticks(), [15.0, 20.0, 30.0, 40.0]);
        assert_eq!(LogScale::new(900.0, 2e6, 0.0, 1.0).ticks(), [1e3, 1e4, 1e5, 1e6]);
        let empty = LogScale::around([], 0.0, 1.0);
        assert!(empty.at(3.0).is_finite());
        assert_eq!([0.05, 0.5, 20.0, 5e3, 2e6].map(tick_label), ["0.05", "0.5", "20", "5k", "2M"]);
    }
}
