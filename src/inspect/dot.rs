//! The top of a tree as a graph, in the language of Graphviz.

use super::walk::{What, walk};
use crate::light_tree::LightTree;
use crate::page::{Plain, Short};
use std::fmt::{self, Display, Write};

/// The clusters of a tree's first frame down to some depth, with their shares of the energy, their
/// boxes and their cones. A dashed cluster has parts that are not drawn. The tree must have been
/// verified.
pub fn dot<D: AsRef<[u8]>>(tree: &LightTree<D>, depth: usize) -> String {
    let mut graph = String::from(
        "digraph light_tree {\n  rankdir=LR\n  node [shape=box fontname=\"sans-serif\" fontsize=10]\n",
    );
    let mut total = 0.0;
    walk(tree, |stop| {
        if stop.depth == 0 {
            total += stop.energy;
        }
        false
    });
    walk(tree, |stop| {
        let share = stop.energy / total;
        let [x, y, z] = stop.aabb.extent().to_array().map(|side| Short(side.into()));
        let cone = stop.node.bounds().cone;
        let [theta_o, theta_e] = [cone.theta_o, cone.theta_e].map(|a| a.to_degrees().round());
        let sides = if cone.two_sided { ", both sides" } else { "" };
        let name = match stop.what {
            What::Cluster => String::new(),
            What::Light(row) | What::Emitter(row) => {
                format!("{}\\n", Label(tree.light_path(&tree.lights()[row])))
            }
        };
        let goes_on = !matches!(stop.what, What::Emitter(_));
        let style = if goes_on && stop.depth == depth { " style=dashed" } else { "" };
        let number = stop.number;
        let percent = 100.0 * share;
        let mut write = || {
            writeln!(
                graph,
                "  n{number} [label=\"{name}{percent:.2} % of the energy\\n{x} x {y} x {z} m\\n\
                 cone {theta_o} + {theta_e} degrees{sides}\"{style}]"
            )?;
            match stop.parent {
                // The stronger the broader.
                Some(parent) => {
                    writeln!(graph, "  n{parent} -> n{number} [penwidth={:.2}]", 0.5 + 5.0 * share)
                }
                None => Ok(()),
            }
        };
        write().expect("a text takes any text");
        stop.depth < depth
    });
    graph + "}\n"
}

/// A text within a quoted label, where it means itself.
struct Label<'a>(&'a str);

impl Display for Label<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for char in self.0.chars() {
            match char {
                '"' | '\\' => write!(f, "\\{char}")?,
                '&' => f.write_str("&amp;")?,
                // The backslash of its spelling is escaped too.
                char => write!(f, "{}", Plain(char).to_string().replace('\\', "\\\\"))?,
            }
        }
        Ok(())
    }
}
