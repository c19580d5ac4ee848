//! What a measurement was made on: times hold for it alone.

use serde::{Deserialize, Serialize};
use std::fs;

/// A machine and the program that ran on it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor, as it names itself.
    pub processor: String,
    /// Threads that rendered.
    pub threads: usize,
    /// The operating system.
    pub system: String,
    /// Program and version.
    pub program: String,
}

impl Machine {
    /// This one. `threads` are those that render.
    pub fn this(threads: usize) -> Machine {
        let read = |path: &str| fs::read_to_string(path).ok();
        let processor = read("/proc/cpuinfo").and_then(|text| model(&text));
        let system = [read("/proc/sys/kernel/ostype"), read("/proc/sys/kernel/osrelease")];
        let system: Vec<String> = system.into_iter().flatten().map(|s| s.trim().into()).collect();
        Machine {
            processor: processor.unwrap_or_else(|| std::env::consts::ARCH.into()),
            threads,
            system: match system.is_empty() {
                true => std::env::consts::OS.into(),
                false => system.join(" "),
            },
            program: concat!("candelabra ", env!("CARGO_PKG_VERSION")).into(),
        }
    }
}

/// The name of the first processor that Linux lists.
fn model(text: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_names_itself() {
        let text = "processor\t: 0\nmodel name\t: Some CPU @ 2.00GHz\nflags\t: fpu\n";
        assert_eq!(model(text).as_deref(), Some("Some CPU @ 2.00GHz"));
        assert_eq!(model("processor : 0"), None);
        assert!(!Machine::this(2).system.is_empty());
    }
}
