//! The list of all options, for people and for programs.

use super::{Allowed, Definition, Options, Section};
use serde::Serialize;
use std::fmt::Write;

/// An option as it is listed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OptionInfo {
    /// Its full name.
    pub name: &'static str,
    /// The text of its default.
    pub default: String,
    /// The values that it may have.
    pub range: String,
    /// What it does.
    pub meaning: String,
}

/// All options, section by section.
pub fn list() -> Vec<OptionInfo> {
    Options::default().sections().into_iter().flat_map(of_section).collect()
}

fn of_section(section: &dyn Section) -> Vec<OptionInfo> {
    let options = section.definitions().into_iter().zip(section.values());
    let info = |(option, default): (Definition, String)| OptionInfo {
        name: option.name,
        default,
        range: option.range(),
        meaning: meaning(&option),
    };
    options.map(info).collect()
}

/// Its doc comment, and the meanings of the words that can be chosen.
fn meaning(option: &Definition) -> String {
    let mut text = option.meaning.trim().to_owned();
    if let Allowed::Words(words) = option.allowed {
        let is_switch = words.iter().all(|w| ["on", "off"].contains(&w.word));
        for w in words.iter().filter(|_| !is_switch) {
            let _ = write!(text, " `{}`: {}", w.word, w.meaning.trim()); // writing to a String cannot fail
        }
    }
    text
}

/// The list for a terminal.
pub fn list_as_text() -> String {
    let mut out = String::new();
    for section in Options::default().sections() {
        let _ = writeln!(out, "[{}] {}", section.name(), section.about().trim());
        for option in of_section(section) {
            let OptionInfo { name, default, range, meaning } = option;
            let default = if default.is_empty() { "\"\"" } else { &default };
            let _ = writeln!(out, "  {name} = {default}  ({})\n      {meaning}", range.replace('`', ""));
        }
        out.push('\n');
    }
    out.trim_end().to_owned()
}

/// The page docs/options.md.
pub fn list_as_markdown() -> String {
    let mut out = HEAD.to_owned();
    for section in Options::default().sections() {
        let (name, about) = (section.name(), section.about().trim());
        let _ = write!(
            out,
            "\n## {name}\n\n{about}\n\n| option | default | range | meaning |\n|---|---|---|---|\n"
        );
        for option in of_section(section) {
            let OptionInfo { name, default, range, meaning } = option;
            let default = if default.is_empty() { String::new() } else { format!("`{default}`") };
            let _ = writeln!(out, "| `{name}` | {default} | {range} | {meaning} |");
        }
    }
    out
}

const HEAD: &str = "# Options of training

`refraxel train --set surface.blur=2` changes one option. The section can be left out where only one section has such
an option: `--set steps=2000`. A TOML file for `--config` has the sections as tables:

```toml
[run]
steps = 2000

[surface]
blur = 2.0
```

This page is printed by `refraxel train --options --markdown > docs/options.md`.
";
