//! Text that stays text, in content and in quoted attributes alike.

use super::plain::{Plain, is_visible};
use std::fmt::{self, Display, Write};

/// Displays a text so that no part of it is taken for markup. What is not visible is spelled out.
pub struct Escaped<'a>(pub &'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for char in self.0.chars() {
            match char {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                char if !is_visible(char) && !"\t\n\r".contains(char) => {
                    write!(f, "{}", Plain(char))?
                }
                char => f.write_char(char)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nothing_that_could_be_markup_is_left(text in any::<String>()) {
            let escaped = Escaped(&text).to_string();
            prop_assert!(!escaped.contains(['<', '>', '"', '\'']));
            let entities = ["amp;", "lt;", "gt;", "quot;", "#39;"];
            for rest in escaped.split('&').skip(1) {
                prop_assert!(entities.iter().any(|entity| rest.starts_with(entity)));
            }
        }
    }

    #[test]
    fn plain_text_is_not_touched() {
        let plain = "/World/Straße/灯_12[3] = 1/2";
        assert_eq!(Escaped(plain).to_string(), plain);
    }
}
