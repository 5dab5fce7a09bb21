//! From what a user calls an option to the option.

use super::gone::GONE;
use super::sections::Options;
use super::{Definition, OptionError};

impl Options {
    /// Changes one option, as `--set KEY=TEXT` does. The key is a full name, or a key that only one section has.
    pub fn set(&mut self, key: &str, text: &str) -> Result<(), OptionError> {
        let option = find(key)?;
        let name = option.name.split('.').next();
        for section in self.sections_mut() {
            if Some(section.name()) == name {
                section.set(&option, text)?;
            }
        }
        Ok(())
    }
}

/// The option of a full name (`grid.resolution`), or of a key that only one section has (`resolution` if there were no other).
fn find(key: &str) -> Result<Definition, OptionError> {
    let all = Options::definitions();
    let named = |name: &str| all.iter().find(|option| option.name == name).copied();
    if let Some(option) = named(key) {
        return Ok(option);
    }
    if let Some(gone) =
        GONE.iter().find(|gone| gone.name == key || last_part(gone.name) == key && !has_key(&all, key))
    {
        return Err(OptionError::Gone { key: gone.name, now: gone.now });
    }
    let candidates: Vec<Definition> = all.iter().filter(|o| last_part(o.name) == key).copied().collect();
    match candidates[..] {
        [option] => Ok(option),
        [] => Err(OptionError::Unknown { key: key.to_owned(), suggestion: similar(key, &all) }),
        _ => {
            let candidates = candidates.iter().map(|option| option.name).collect();
            Err(OptionError::Ambiguous { key: key.to_owned(), candidates })
        }
    }
}

/// Some option has this key in its section.
fn has_key(all: &[Definition], key: &str) -> bool {
    all.iter().any(|option| last_part(option.name) == key)
}

fn last_part(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// The name from which `key` differs in the fewest letters, if at most a third of them differ. Both the full name and the
/// key of an option are compared.
fn similar(key: &str, all: &[Definition]) -> Option<&'static str> {
    let whole = |name: &'static str| strsim::damerau_levenshtein(key, name);
    let part = |name: &'static str| strsim::damerau_levenshtein(last_part(key), last_part(name));
    let least = |name| whole(name).min(part(name));
    // Of several sections with the same key, that with the most similar name.
    let nearest = all.iter().map(|option| option.name).min_by_key(|&name| (least(name), whole(name)))?;
    (3 * least(nearest) <= key.chars().count()).then_some(nearest)
}
