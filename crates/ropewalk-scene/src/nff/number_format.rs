//! Numbers as C's `printf("%g")` prints them.

use std::fmt::Write;

/// How many digits the writer prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberFormat {
    /// As C's `%.Ng`: N significant digits, 1 or more (0 counts as 1). The generators of the
    /// Standard Procedural Databases print 6.
    Significant(u8),
    /// As few digits as read back to the same `f64`, up to 17.
    Shortest,
}

impl Default for NumberFormat {
    fn default() -> Self {
        NumberFormat::Significant(6)
    }
}

/// Prints `value` with at most `digits` significant digits as C's `%.*g` does: correctly rounded,
/// without trailing zeros, with an exponent of at least two digits if it is below -4 or not below
/// `digits`.
pub fn format_g(value: f64, digits: u8) -> String {
    let mut out = String::new();
    push_number(&mut out, &mut String::new(), value, NumberFormat::Significant(digits));
    out
}

/// Longest number with [`NumberFormat::Shortest`] before it takes an exponent, in digits.
const SHORTEST_DIGITS: i32 = 17;

/// Appends a number to `out`; `scratch` saves an allocation.
pub(super) fn push_number(
    out: &mut String,
    scratch: &mut String,
    value: f64,
    format: NumberFormat,
) {
    if !value.is_finite() {
        out.push_str(match (value.is_nan(), value < 0.0) {
            (true, _) => "nan",
            (false, true) => "-inf",
            (false, false) => "inf",
        });
        return;
    }
    // The decimal digits and exponent, correctly rounded: `-d.ddde-x`.
    scratch.clear();
    let (written, precision) = match format {
        NumberFormat::Significant(digits) => {
            let digits = usize::from(digits.max(1));
            (write!(scratch, "{value:.*e}", digits - 1), digits as i32)
        }
        NumberFormat::Shortest => (write!(scratch, "{value:e}"), SHORTEST_DIGITS),
    };
    debug_assert!(written.is_ok(), "writing to a string cannot fail");
    let (mantissa, exponent) = scratch.split_once('e').unwrap_or((scratch, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let unsigned = mantissa.strip_prefix('-').unwrap_or(mantissa);
    let (units, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    let fraction = fraction.trim_end_matches('0');
    if value.is_sign_negative() {
        out.push('-');
    }
    if exponent < -4 || exponent >= precision {
        out.push_str(units);
        push_fraction(out, fraction);
        out.push_str(if exponent < 0 { "e-" } else { "e+" });
        if exponent.abs() < 10 {
            out.push('0');
        }
        let written = write!(out, "{}", exponent.abs());
        debug_assert!(written.is_ok(), "writing to a string cannot fail");
    } else if exponent < 0 {
        out.push_str("0.");
        (1..-exponent).for_each(|_| out.push('0'));
        out.push_str(units);
        out.push_str(fraction);
    } else {
        // Digits before the point beyond those that are left are zeros.
        let whole = fraction.len().min(exponent as usize);
        out.push_str(units);
        out.push_str(&fraction[..whole]);
        (whole..exponent as usize).for_each(|_| out.push('0'));
        push_fraction(out, &fraction[whole..]);
    }
}

fn push_fraction(out: &mut String, fraction: &str) {
    if !fraction.is_empty() {
        out.push('.');
        out.push_str(fraction);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values, digits, and what C's `printf("%.*g")` of glibc prints for them.
    const PRINTF: [(f64, u8, &str); 40] = [
        (0.0, 6, "0"),
        (-0.0, 6, "-0"),
        (1.0, 6, "1"),
        (-1.0, 6, "-1"),
        (10.0, 6, "10"),
        (100000.0, 6, "100000"),
        (1000000.0, 6, "1e+06"),
        (999999.0, 6, "999999"),
        (999999.4, 6, "999999"),
        (999999.5, 6, "1e+06"),
        (1234567.0, 6, "1.23457e+06"),
        (123456.0, 6, "123456"),
        (120000.0, 6, "120000"),
        (0.1, 6, "0.1"),
        (0.5, 6, "0.5"),
        (0.0001, 6, "0.0001"),
        (0.00001, 6, "1e-05"),
        (0.00012345678, 6, "0.000123457"),
        (0.000099999999, 6, "0.0001"),
        (0.0000999999, 6, "9.99999e-05"),
        (1.0 / 3.0, 6, "0.333333"),
        (2.0 / 3.0, 6, "0.666667"),
        (-4.440892098500626e-16, 6, "-4.44089e-16"),
        (3.4028234663852886e38, 6, "3.40282e+38"),
        (1e100, 6, "1e+100"),
        (1e-100, 6, "1e-100"),
        (5e-324, 6, "4.94066e-324"),
        (1.5, 1, "2"),
        (2.5, 1, "2"),
        (0.25, 1, "0.2"),
        (12.0, 1, "1e+01"),
        (12.0, 0, "1e+01"),
        (0.1, 17, "0.10000000000000001"),
        (0.1, 20, "0.10000000000000000555"),
        (100.5, 4, "100.5"),
        (100.05, 4, "100"),
        (100.06, 4, "100.1"),
        (123456789.0, 9, "123456789"),
        (123456789.0, 8, "1.2345679e+08"),
        (512.0, 6, "512"),
    ];

    #[test]
    fn format_g_prints_as_c_does() {
        for (value, digits, expected) in PRINTF {
            assert_eq!(format_g(value, digits), expected, "%.{digits}g of {value:e}");
        }
        assert_eq!(format_g(f64::NAN, 6), "nan");
        assert_eq!(format_g(f64::NEG_INFINITY, 6), "-inf");
    }

    proptest::proptest! {
        #[test]
        fn shortest_numbers_read_back_exactly(bits: u64) {
            let value = f64::from_bits(bits);
            proptest::prop_assume!(value.is_finite());
            let (mut out, mut scratch) = (String::new(), String::new());
            push_number(&mut out, &mut scratch, value, NumberFormat::Shortest);
            proptest::prop_assert_eq!(out.parse::<f64>().map(f64::to_bits), Ok(bits), "{}", out);
            proptest::prop_assert!(out.len() <= 24, "{} is too long", out);
        }

        #[test]
        fn rounded_numbers_are_within_half_a_digit(value in -1e9..1e9_f64, digits in 1..12_u8) {
            let read: f64 = format_g(value, digits).parse().unwrap();
            let unit = 10f64.powi(value.abs().log10().floor() as i32 + 1 - i32::from(digits));
            // Half a unit of the last digit, and the rounding of this test's own arithmetic.
            proptest::prop_assert!((read - value).abs() <= 0.5 * unit * (1.0 + 1e-9) + 1e-15 * value.abs());
        }
    }
}
