//! Tokens: what OpenCue writes into a command for every task.
//!
//! | token | becomes |
//! |---|---|
//! | `#IFRAME#`, `#FRAME_START#` | the first frame of the chunk |
//! | `#ZFRAME#` | the same in at least four places: `0007` |
//! | `#FRAME_END#` | the last frame of the chunk |
//! | `#FRAME_CHUNK#` | the chunk's size, as the layer has it |
//! | `#FRAMESPEC#` | all frames of the chunk, as `1001-1006` or `1-9x2` |
//! | `#FRAME#` | the task's name: `1001-render` |
//! | `#LAYER#`, `#JOB#` | the names |
//!
//! Source: Cuebot's `DispatchSupportService`. Cuebots before August 2024 miscalculate `#FRAME_END#` in
//! the last chunk of a layer, so `#FRAMESPEC#` is the one to use.

/// The tokens, without their number signs, in the order in which Cuebot replaces them.
pub const TOKENS: [&str; 9] = [
    "ZFRAME",
    "IFRAME",
    "FRAME_START",
    "FRAME_END",
    "FRAME_CHUNK",
    "LAYER",
    "JOB",
    "FRAMESPEC",
    "FRAME",
];

/// A command with every token replaced by its value.
pub fn expand<'a>(command: &str, value: impl Fn(&str) -> &'a str) -> String {
    let replace = |text: String, token: &&str| text.replace(&format!("#{token}#"), value(token));
    TOKENS.iter().fold(command.into(), replace)
}

/// The first thing in a command that looks like a token, capitals between number signs, and is none: a slip, which
/// a shell would take for a comment.
pub fn unknown(command: &str) -> Option<&str> {
    let mut rest = command;
    while let Some((_, inside)) = rest.split_once('#') {
        let end =
            inside.find(|c: char| !c.is_ascii_uppercase() && c != '_').unwrap_or(inside.len());
        let (name, after) = inside.split_at(end);
        rest = match after.strip_prefix('#') {
            Some(after) if TOKENS.contains(&name) => after,
            Some(_) if !name.is_empty() => return Some(name),
            _ => after,
        };
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_replaced_wherever_they_stand() {
        let value = |name: &str| if name == "IFRAME" { "7" } else { "<>" };
        for (command, expected) in [
            ("a -f #IFRAME#", "a -f 7"),
            ("'x.#IFRAME#.exr'#IFRAME##IFRAME#", "'x.7.exr'77"),
            ("x.####.exr # note", "x.####.exr # note"),
            ("##IFRAME##", "#7#"),
            ("#IFRAME", "#IFRAME"),
            ("#LAYER#IFRAME#", "#LAYER7"),
            ("ü#ü #FRAMESPEC#", "ü#ü <>"),
            ("${x#y}", "${x#y}"),
            ("", ""),
        ] {
            assert_eq!(expand(command, value), expected, "{command}");
        }
    }

    #[test]
    fn a_slip_is_found() {
        for (command, slip) in [
            ("a #FRAMSPEC# #IFRAME#", Some("FRAMSPEC")),
            ("a #IFRAME#V2#LAYER# #IFRAME#V#LAYER#", None),
            ("a #FRAMESPEC# ####.exr #x# #", None),
            ("##_FRAME#", Some("_FRAME")),
            ("#A", None),
        ] {
            assert_eq!(unknown(command), slip, "{command}");
        }
    }
}
