//! The list of all options, for people and for programs.

use super::sections::Options;
use super::{Allowed, Definition, Section};
use refraxel_core::{Extent, Projection, Vec3};
use serde::Serialize;
use std::fmt::Write;

/// An option as it is listed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OptionInfo {
    /// Its full name.
    pub name: &'static str,
    /// The text of its default.
    pub default: String,
    /// The text of its default for photographs of surroundings without bounds, if that is another.
    pub unbounded: Option<String>,
    /// The text of its default for cameras that all look one way, if that is another than for other photographs of surroundings.
    pub forward: Option<String>,
    /// The values that it may have.
    pub range: String,
    /// What it does.
    pub meaning: String,
}

impl OptionInfo {
    /// Its defaults, `shown` with their texts.
    fn defaults(&self, shown: impl Fn(&str) -> String) -> String {
        let named = |kind: &str, text: &Option<String>| {
            text.as_ref().map(|text| format!("; {kind} {}", shown(text))).unwrap_or_default()
        };
        shown(&self.default) + &named("unbounded", &self.unbounded) + &named("forward-facing", &self.forward)
    }
}

/// All options, section by section.
pub fn list() -> Vec<OptionInfo> {
    sections().into_iter().flat_map(|(_, _, options)| options).collect()
}

/// Names, meanings and options of all sections.
fn sections() -> Vec<(&'static str, &'static str, Vec<OptionInfo>)> {
    let usual = Options::default();
    let [unbounded, forward] = [Extent::Contracted, FORWARD].map(|extent| Options::suited_to(extent, false));
    let all = usual.sections().into_iter().zip(unbounded.sections()).zip(forward.sections());
    all.map(|((usual, unbounded), forward)| {
        (usual.name(), usual.about().trim(), of_section(usual, unbounded, forward))
    })
    .collect()
}

/// Any forward-facing capture: defaults do not depend on its frame.
const FORWARD: Extent = Extent::Projective(Projection {
    eye: Vec3::new(0.0, 0.0, 0.0),
    axes: [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)],
    near: 1.0,
    edges: [[-1.0, 1.0]; 2],
    baseline: 1.0,
});

fn of_section(usual: &dyn Section, unbounded: &dyn Section, forward: &dyn Section) -> Vec<OptionInfo> {
    let values = usual.values().into_iter().zip(unbounded.values()).zip(forward.values());
    let info =
        |(option, ((default, unbounded), forward)): (Definition, ((String, String), String))| OptionInfo {
            name: option.name,
            forward: (forward != unbounded).then_some(forward),
            unbounded: (unbounded != default).then_some(unbounded),
            default,
            range: option.range(),
            meaning: meaning(&option),
        };
    usual.definitions().into_iter().zip(values).map(info).collect()
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
    for (section, about, options) in sections() {
        let _ = writeln!(out, "[{section}] {about}");
        for option in options {
            let OptionInfo { name, range, meaning, .. } = &option;
            let default = option.defaults(|text| if text.is_empty() { "\"\"" } else { text }.to_owned());
            let _ = writeln!(out, "  {name} = {default}  ({})\n      {meaning}", range.replace('`', ""));
        }
        out.push('\n');
    }
    out.trim_end().to_owned()
}

/// The page docs/options.md.
pub fn list_as_markdown() -> String {
    let mut out = HEAD.to_owned();
    for (section, about, options) in sections() {
        let _ = write!(
            out,
            "\n## {section}\n\n{about}\n\n| option | default | range | meaning |\n|---|---|---|---|\n"
        );
        for option in options {
            let OptionInfo { name, range, meaning, .. } = &option;
            let default =
                option.defaults(|text| if text.is_empty() { String::new() } else { format!("`{text}`") });
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

*Unbounded*: the default where photographs show surroundings, and not things before a transparent or plain backdrop.
*Forward-facing*: the default where all cameras look one way, if it is another.

This page is printed by `refraxel train --options --markdown > docs/options.md`.
";
