//! Numbers as people read them.

use std::fmt;

/// A count with its thousands apart: `1,204`.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Count(
    /// The count.
    pub usize,
);

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = self.0.to_string();
        let mut grouped = String::new();
        for (i, digit) in digits.chars().enumerate() {
            if i > 0 && (digits.len() - i).is_multiple_of(3) {
                grouped.push(',');
            }
            grouped.push(digit);
        }
        f.pad(&grouped)
    }
}

/// A count of something: `1 light`, `1,204 lights`.
pub fn counted(count: usize, what: &str) -> String {
    format!("{} {what}{}", Count(count), if count == 1 { "" } else { "s" })
}

/// A quantity in four significant digits, without zeros at its end: `0.25`, `1.204e7`.
#[derive(Clone, Copy)]
pub struct Short(
    /// The quantity.
    pub f64,
);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || !size.is_finite() {
            return write!(f, "{}", self.0.abs());
        }
        if !(1e-3..1e6).contains(&size) {
            let text = format!("{:.3e}", self.0);
            let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            return write!(f, "{}e{exponent}", trimmed(digits));
        }
        let decimals = (3 - size.log10().floor() as i32).max(0) as usize;
        write!(f, "{}", trimmed(&format!("{:.*}", decimals, self.0)))
    }
}

/// Without the zeros at the end of a fraction.
fn trimmed(digits: &str) -> &str {
    match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.'),
        false => digits,
    }
}

/// Three quantities: `(1, 0.25, -3)`.
#[derive(Clone, Copy)]
pub struct Triple(
    /// The quantities.
    pub [f32; 3],
);

impl fmt::Display for Triple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0.map(|v| Short(f64::from(v)));
        write!(f, "({x}, {y}, {z})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let counts = [0, 12, 999, 1000, 1_234_567].map(|n| Count(n).to_string());
        assert_eq!(counts, ["0", "12", "999", "1,000", "1,234,567"]);
        assert_eq!([counted(1, "light"), counted(2, "light")], ["1 light", "2 lights"]);
        for (number, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.25, "0.25"),
            (-1.0, "-1"),
            (100.0, "100"),
            (99_999.6, "100000"),
            (1.2345e7, "1.234e7"),
            (2e-5, "2e-5"),
            (0.001, "0.001"),
            (-37.204_5, "-37.2"),
        ] {
            assert_eq!(Short(number).to_string(), text);
        }
    }
}
