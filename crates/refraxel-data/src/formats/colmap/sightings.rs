//! Which coloured points images show, as the tracks of points say.

use super::files::{images, points};
use crate::DataError;
use crate::parsed::Sighting;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Of each of these images the coloured points that it shows; of a model without tracks all points.
pub(crate) fn sightings(model: &Path, names: &[&str]) -> Result<HashMap<String, Vec<Sighting>>, DataError> {
    let wanted: HashMap<u32, String> = images(model)?
        .all
        .into_iter()
        .filter(|image| names.contains(&image.name.as_str()))
        .map(|image| (image.id, image.name))
        .collect();
    let points = points(model, &wanted.keys().copied().collect::<HashSet<_>>())?;
    let has_tracks = points.iter().any(|point| !point.seen_by.is_empty());
    let mut all: HashMap<String, Vec<Sighting>> = HashMap::new();
    for (id, name) in wanted {
        let seen = points.iter().filter(|point| !has_tracks || point.seen_by.contains(&id));
        let sighting = seen.filter_map(|p| Some(Sighting { position: p.position, colour: p.colour? }));
        all.insert(name, sighting.collect());
    }
    Ok(all)
}
