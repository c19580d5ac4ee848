//! Numbers as people read them.

/// A count with its thousands apart: `1,234,567`.
pub fn count(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.char_indices() {
        if place > 0 && (digits.len() - place) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number to four digits: `12.35`, `0.001200`, `1.235e7`.
pub fn rounded(number: f64) -> String {
    let size = number.abs();
    match size {
        0.0 => "0".into(),
        1e-3..1e5 => {
            let decimals = (3 - size.log10().floor() as i32).max(0) as usize;
            format!("{number:.decimals$}")
        }
        _ => format!("{number:.3e}"),
    }
}

/// Bytes in the largest unit that leaves a whole number of them: `1.5 MB`.
pub fn bytes(bytes: usize) -> String {
    let units = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let fits = units.into_iter().find(|(unit, _)| bytes as f64 >= *unit);
    fits.map_or(format!("{bytes} bytes"), |(unit, name)| {
        format!("{:.1} {name}", bytes as f64 / unit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(
            [0, 12, 999, 1000, 1234567].map(count),
            ["0", "12", "999", "1,000", "1,234,567"]
        );
        let numbers = [0.0, 12.345, -0.0012, 99999.4, 1.2345e7, 1e-9];
        let words = ["0", "12.35", "-0.001200", "99999", "1.234e7", "1.000e-9"];
        assert_eq!(numbers.map(rounded), words);
        assert_eq!([12, 1500, 2_400_000].map(bytes), ["12 bytes", "1.5 kB", "2.4 MB"]);
    }
}
