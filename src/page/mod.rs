//! Floor 1: pages for people, with tables and pictures in one HTML file. The module knows nothing of
//! lights or trees.
//!
//! A [`Page`] holds everything that it needs and loads nothing from the network; its content security
//! policy forbids it. It follows the reader's choice of light or dark and can be printed. It is complete
//! without scripts, which only sort tables and switch between levels. All text is escaped, so none of it
//! becomes markup. The same parts give the same bytes.
//!
//! | file | what |
//! |---|---|
//! | `escape` | text that stays text |
//! | `plain` | text that a terminal does not obey: [`Plain`], [`Lines`] |
//! | `table` | a [`Table`] that sorts |
//! | `plan` | a [`Plan`]: marks in space, from above and from the front |
//! | `view`, `axes` | one way of looking at it, and the ticks around it |
//! | `shade` | marks too many to be drawn, as a ground of density |
//! | `ground` | numbers of many boxes above each other, as a ground of colours |
//! | `chart` | a [`Chart`]: curves over logarithmic axes |
//! | `heat` | a [`HeatMap`]: numbers on a grid as colours |
//! | `wipe` | a [`Wipe`]: pictures of one thing, two of them under a slider |
//! | `raster` | pixels as an image inside the page |
//! | `number` | numbers as people read them |

mod axes;
mod chart;
mod escape;
mod ground;
mod heat;
mod number;
mod plain;
mod plan;
mod raster;
mod shade;
mod table;
mod view;
mod wipe;

pub use chart::{Chart, Curve, Dot};
pub use heat::{HeatMap, Scale};
pub use number::{Count, Short, Triple, counted};
pub use plain::{Lines, Plain, plain_json};
pub use plan::{Cuboid, Level, Mark, Plan};
pub use table::{Cell, Column, Table};
pub use wipe::Wipe;

use escape::Escaped;
use std::fmt::{self, Display, Write};

/// What a page is made of: it displays itself as HTML, with all text escaped.
pub trait Part: Display {}

/// Colours that differ by more than hue, in light and in dark (after Okabe and Ito).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// For what is there and nothing more.
    Grey,
    /// For what is usual.
    Blue,
    /// For what has changed.
    Orange,
    /// For what has come.
    Green,
    /// For what has gone.
    Red,
    /// For what is called otherwise.
    Violet,
}

impl Ink {
    /// The class that the style sheet knows it by.
    fn class(self) -> &'static str {
        match self {
            Ink::Grey => "grey",
            Ink::Blue => "blue",
            Ink::Orange => "orange",
            Ink::Green => "green",
            Ink::Red => "red",
            Ink::Violet => "violet",
        }
    }
}

/// A page that grows from top to bottom.
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// A page with nothing but a title.
    pub fn new(title: &str) -> Page {
        Page { title: title.into(), body: String::new() }
    }

    /// Adds a heading.
    pub fn heading(&mut self, text: &str) {
        self.push(format_args!("<h2>{}</h2>\n", Escaped(text)));
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: &str) {
        self.push(format_args!("<p>{}</p>\n", Escaped(text)));
    }

    /// Adds names with their values.
    pub fn facts<'a>(&mut self, facts: impl IntoIterator<Item = (&'a str, String)>) {
        self.body += "<dl>\n";
        for (name, value) in facts {
            let (name, value) = (Escaped(name), Escaped(&value));
            self.push(format_args!("<div><dt>{name}</dt><dd>{value}</dd></div>\n"));
        }
        self.body += "</dl>\n";
    }

    /// Adds a table or a picture.
    pub fn add(&mut self, part: &impl Part) {
        self.push(format_args!("{part}"));
    }

    fn push(&mut self, text: fmt::Arguments) {
        self.body.write_fmt(text).expect("a text takes any text");
    }

    /// The whole file.
    pub fn finish(self) -> String {
        let title = Escaped(&self.title);
        // No text can hold the hash of the page that it is on, so none can pass for the page's own
        // script or style.
        let own = blake3::hash(self.body.as_bytes()).to_hex();
        format!(
            "<!DOCTYPE html>\n\
             <html lang=\"en\">\n\
             <head>\n\
             <meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; \
             style-src 'nonce-{own}'; script-src 'nonce-{own}'\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n\
             <title>{title}</title>\n\
             <style nonce=\"{own}\">\n{style}</style>\n\
             </head>\n\
             <body>\n\
             <h1>{title}</h1>\n\
             {body}\
             <script nonce=\"{own}\">\n{script}</script>\n\
             </body>\n\
             </html>\n",
            style = concat!(
                include_str!("colors.css"),
                include_str!("page.css"),
                include_str!("drawing.css")
            ),
            body = self.body,
            script = include_str!("page.js"),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const HOSTILE: &str = "/World/<script>alert(\"1\")</script>' onload='x&amp;\u{202e}灯\0";

    #[test]
    fn hostile_text_stays_text_wherever_it_goes() {
        let mut page = Page::new(HOSTILE);
        page.heading(HOSTILE);
        page.text(HOSTILE);
        page.facts([(HOSTILE, HOSTILE.into())]);
        page.add(&Table {
            caption: HOSTILE.into(),
            columns: vec![Column::text(HOSTILE)],
            rows: vec![vec![Cell::Text(HOSTILE.into())], vec![Cell::Key(Ink::Red, HOSTILE.into())]],
        });
        let mut plan = Plan::new(HOSTILE, Cuboid { min: Vec3::ZERO, max: Vec3::ONE });
        plan.kinds = vec![(Ink::Blue, HOSTILE.into())];
        plan.marks = vec![Mark {
            at: Vec3::ZERO,
            from: None,
            weight: 1.0,
            ink: Ink::Blue,
            label: HOSTILE.into(),
        }];
        plan.levels = vec![Level { name: HOSTILE.into(), boxes: vec![] }];
        page.add(&plan);
        let dot = Dot { at: [1.0, 1.0], range: None, label: HOSTILE.into(), is_marked: true };
        page.add(&Chart {
            caption: HOSTILE.into(),
            axes: [HOSTILE.into(), HOSTILE.into()],
            curves: vec![Curve {
                name: HOSTILE.into(),
                ink: Ink::Red,
                is_dashed: true,
                dots: vec![dot],
            }],
            goal: Some((1.0, HOSTILE.into())),
        });
        page.add(&Wipe {
            caption: HOSTILE.into(),
            pictures: vec![(HOSTILE.into(), image::RgbImage::new(2, 1))],
        });
        page.add(&HeatMap {
            caption: HOSTILE.into(),
            width: 1,
            values: vec![1.0],
            scale: Scale::Gain { limit: 2.0, unit: HOSTILE.into() },
        });
        let html = page.finish().replace("<wbr>", "");
        let inert = "/World/&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&#39; onload=&#39;x&amp;amp;\\u{202e}灯\\0";
        assert!(html.matches(inert).count() >= 20, "{html}");
        assert_eq!(html.matches("<script").count(), 1);
        assert!(!html.contains("onload='") && !html.contains(['\0', '\u{202e}']));
    }

    #[test]
    fn a_page_names_nothing_outside_itself() {
        let html = Page::new("t").finish();
        let elsewhere = ["http://", "https://", "src=", "@import", "url("];
        assert!(elsewhere.iter().all(|text| !html.contains(text)), "{html}");
    }
}
