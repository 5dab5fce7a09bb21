//! From what a user calls an option to the option.

use super::former::{FORMER, REMOVED};
use super::{Definition, OptionError, Options};

/// An option that was called by the name that it had before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Renamed {
    /// The name that was used.
    pub former: String,
    /// The full name today.
    pub now: &'static str,
}

/// The option that was meant, and whether the name is a former one.
pub(super) struct Found {
    pub(super) option: Definition,
    pub(super) renamed: Option<Renamed>,
}

/// The option of a full name (`surface.blur`), of a key that only one section has (`coarsening`), or of a former name
/// (`surface_blur`).
pub(super) fn find(key: &str) -> Result<Found, OptionError> {
    let all = Options::definitions();
    let named = |name: &str| all.iter().find(|option| option.name == name).copied();
    if let Some(option) = named(key) {
        return Ok(Found { option, renamed: None });
    }
    if let Some(former) = FORMER.iter().find(|f| f.name == key) {
        let renamed = Renamed { former: key.to_owned(), now: former.now };
        let option = named(former.now).unwrap_or_else(|| unreachable!("{} is an option", former.now));
        return Ok(Found { option, renamed: Some(renamed) });
    }
    if let Some(removed) = REMOVED.iter().find(|r| r.name == key) {
        return Err(OptionError::Removed { key: removed.name, advice: removed.advice });
    }
    let candidates: Vec<Definition> = all.iter().filter(|o| last_part(o.name) == key).copied().collect();
    match candidates[..] {
        [option] => Ok(Found { option, renamed: None }),
        [] => Err(OptionError::Unknown { key: key.to_owned(), suggestion: similar(key, &all) }),
        _ => {
            let candidates = candidates.iter().map(|option| option.name).collect();
            Err(OptionError::Ambiguous { key: key.to_owned(), candidates })
        }
    }
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
