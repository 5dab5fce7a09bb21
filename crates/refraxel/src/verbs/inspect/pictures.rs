//! The pictures of a dataset, as files.

use super::contact::{self, Tile};
use super::doubt::{Doubt, Kind};
use super::from_above::{self, Scene, Shown};
use super::look::{Look, evenly};
use super::names::by_name;
use super::per_view::{self, Numbers};
use super::views::Views;
use crate::exit::Failure;
use crate::verbs::files::create_folder;
use refraxel_data::{Dataset, Region};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Photographs of a contact sheet, and how many of these at most have warnings.
const SHEET: usize = 48;
const DOUBTED: usize = 36;

/// The files that were written.
#[derive(Serialize)]
pub struct Pictures {
    /// Photographs with their masks and warnings.
    pub photographs: PathBuf,
    /// The cameras from above and from the side.
    pub cameras: PathBuf,
    /// Brightness and sharpness.
    pub views: PathBuf,
}

/// Writes the pictures into a folder; those of an earlier call are replaced.
pub fn write(data: &Dataset, region: &Region, views: &Views, folder: &Path) -> Result<Pictures, Failure> {
    create_folder(folder)?;
    let path = |name: &str| folder.join(format!("inspect_{name}.png"));
    let pictures =
        Pictures { photographs: path("photographs"), cameras: path("cameras"), views: path("views") };
    let title = data.root.as_deref().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    sheet(data, views, &title).save_png(&pictures.photographs)?;
    cameras(data, region, views, &title).save_png(&pictures.cameras)?;
    numbers(views, &title).save_png(&pictures.views)?;
    Ok(pictures)
}

/// Photographs with warnings first, then others, evenly chosen, in the order of names.
fn sheet(data: &Dataset, views: &Views, title: &str) -> crate::canvas::Canvas {
    let ordered = in_order(views);
    let has_warning = |look: &&Look| views.of(look.view).any(Doubt::is_warning);
    let (doubted, others): (Vec<&Look>, Vec<&Look>) = ordered.into_iter().partition(has_warning);
    let some = |looks: &[&'_ Look], most: usize| evenly(looks.len(), most);
    let first = some(&doubted, DOUBTED);
    let rest = some(&others, SHEET - first.len());
    let shown = first.iter().map(|&k| doubted[k]).chain(rest.iter().map(|&k| others[k]));
    let tiles: Vec<Tile<'_>> = shown
        .map(|look| Tile {
            name: &views.names[look.view],
            part: views.parts[look.view],
            warnings: views.of(look.view).filter(|d| d.is_warning()).map(|d| &*d.short).collect(),
            picture: look.picture.as_ref(),
            meaning: data.views[look.view].mask_meaning,
        })
        .collect();
    let count = match tiles.len() {
        n if n == views.looks.len() => format!("{n} photographs"),
        n => format!("{n} of {} photographs", data.views.len()),
    };
    let warned =
        if doubted.is_empty() { String::new() } else { format!(", {} with warnings", doubted.len()) };
    contact::draw(&format!("{title}: {count}{warned}"), &tiles)
}

/// The looks in the order of names.
fn in_order(views: &Views) -> Vec<&Look> {
    let names: Vec<String> = views.looks.iter().map(|l| views.names[l.view].clone()).collect();
    by_name(&names).into_iter().map(|k| &views.looks[k]).collect()
}

fn cameras(data: &Dataset, region: &Region, views: &Views, title: &str) -> crate::canvas::Canvas {
    let is_of = |view: usize, kinds: &[Kind]| views.of(view).any(|d| kinds.contains(&d.kind));
    let shown = |view: usize| Shown {
        camera: &data.views[view].camera,
        part: views.parts[view],
        doubted: is_of(view, &[Kind::FarAway, Kind::LooksAway, Kind::SamePose]).then(|| &*views.names[view]),
        is_far: is_of(view, &[Kind::FarAway]),
    };
    let scene = Scene {
        title: format!("{title}: {} cameras", data.views.len()),
        cameras: (0..data.views.len()).map(shown).collect(),
        points: &data.points,
        bounds: region.bounds,
        up: region.up,
        along: views.along,
    };
    from_above::draw(&scene)
}

fn numbers(views: &Views, title: &str) -> crate::canvas::Canvas {
    let or_nan = |number: Option<f64>| number.unwrap_or(f64::NAN);
    let of = |look: &Look| {
        let measures = look.measures.as_ref().ok();
        let compared = &views.compared[views.position(look.view)];
        let is_of = |kinds: &[Kind]| views.of(look.view).any(|d| kinds.contains(&d.kind));
        Numbers {
            name: &views.names[look.view],
            brightness: [measures.and_then(|m| m.brightness), compared.brightness].map(or_nan),
            sharpness: [measures.and_then(|m| m.sharpness), compared.sharpness].map(or_nan),
            is_doubted: [is_of(&[Kind::Exposed, Kind::Clipped, Kind::Empty]), is_of(&[Kind::Blurred])],
        }
    };
    let numbers: Vec<Numbers<'_>> = in_order(views).into_iter().map(of).collect();
    per_view::draw(&format!("{title}: {} photographs", numbers.len()), &numbers)
}
