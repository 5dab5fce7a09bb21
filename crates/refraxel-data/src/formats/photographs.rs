//! Which names in a folder are photographs.

use crate::extensions::is_picture;
use crate::masks::names_beside;
use crate::naming::picture_stem;
use std::collections::HashSet;

/// The images among these names that are no masks beside others.
pub(super) fn photographs(mut names: Vec<String>) -> Vec<String> {
    names.retain(|name| is_picture(name));
    let masks: HashSet<String> = names.iter().flat_map(|name| names_beside(picture_stem(name))).collect();
    names.retain(|name| !masks.contains(name));
    names
}
