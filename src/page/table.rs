//! A table whose headings sort it.

use super::escape::Escaped;
use super::{Count, Ink, Part, Short};
use std::fmt::{self, Display};

/// Rows under headings. A click on a heading sorts: numbers from the largest, text from A; another
/// click turns the order round.
#[derive(Clone, Debug)]
pub struct Table {
    /// What it is, and what it leaves out.
    pub caption: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows, each with a cell for every column.
    pub rows: Vec<Vec<Cell>>,
}

/// A column.
#[derive(Clone, Debug)]
pub struct Column {
    heading: String,
    is_number: bool,
}

impl Column {
    /// Sorted by letters; numbers within them count as numbers.
    pub fn text(heading: &str) -> Column {
        Column { heading: heading.into(), is_number: false }
    }

    /// Sorted by value.
    pub fn number(heading: &str) -> Column {
        Column { heading: heading.into(), is_number: true }
    }
}

/// A cell.
#[derive(Clone, Debug)]
pub enum Cell {
    /// A text.
    Text(String),
    /// A text beside a spot of colour.
    Key(Ink, String),
    /// A number to sort by, and how it is shown.
    Number(f64, String),
    /// Nothing; sorted as the smallest.
    Empty,
}

impl Cell {
    /// A count.
    pub fn count(count: usize) -> Cell {
        Cell::Number(count as f64, Count(count).to_string())
    }

    /// A quantity, in few digits.
    pub fn short(quantity: f64) -> Cell {
        Cell::Number(quantity, Short(quantity).to_string())
    }
}

impl Part for Table {}

impl Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "<table>\n<caption>{}</caption>", Escaped(&self.caption))?;
        f.write_str("<thead><tr>")?;
        for Column { heading, is_number } in &self.columns {
            let class = if *is_number { " class=\"number\"" } else { "" };
            let heading = Escaped(heading);
            write!(f, "<th scope=\"col\"{class}><button type=\"button\">{heading}</button></th>")?;
        }
        f.write_str("</tr></thead>\n<tbody>\n")?;
        for row in &self.rows {
            f.write_str("<tr>")?;
            row.iter().try_for_each(|cell| write!(f, "{cell}"))?;
            f.write_str("</tr>\n")?;
        }
        f.write_str("</tbody>\n</table>\n")
    }
}

impl Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cell::Text(text) => {
                // A long path had best be broken after a slash.
                let text = Escaped(text).to_string().replace('/', "/<wbr>");
                write!(f, "<td>{text}</td>")
            }
            Cell::Key(ink, text) => {
                write!(f, "<td><i class=\"{}\"></i>{}</td>", ink.class(), Escaped(text))
            }
            Cell::Number(value, text) => {
                f.write_str("<td class=\"number\" data-value=\"")?;
                // In the words of the script's `Number`.
                match value.is_finite() {
                    true => write!(f, "{value:e}")?,
                    false if value.is_nan() => f.write_str("-Infinity")?,
                    false => write!(f, "{}Infinity", if *value < 0.0 { "-" } else { "" })?,
                }
                write!(f, "\">{}</td>", Escaped(text))
            }
            Cell::Empty => f.write_str("<td></td>"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_sorted_by_its_value_and_shown_as_said() {
        let cell = |value| Cell::Number(value, "much".into()).to_string();
        assert_eq!(cell(1500.0), "<td class=\"number\" data-value=\"1.5e3\">much</td>");
        for (value, word) in [(f64::INFINITY, "\"Infinity"), (f64::NAN, "\"-Infinity")] {
            assert!(cell(value).contains(word), "{}", cell(value));
        }
    }
}
