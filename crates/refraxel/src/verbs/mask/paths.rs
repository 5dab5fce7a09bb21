//! Where masks go.

use crate::cli::MaskArgs;
use crate::exit::{Exit, Failure};
use refraxel_data::{Dataset, PhotoSource, View};
use std::path::{Component, Path, PathBuf};

/// Where the masks go: where the program looks for them, if nobody says where.
pub(super) fn folder(args: &MaskArgs, data: &Dataset) -> Result<PathBuf, Failure> {
    let usual = || data.root.as_ref().map(|root| root.join("glass_masks"));
    let nowhere = || Exit::Usage.because("the data are in no folder; say where masks go with --out");
    args.out.clone().or_else(usual).ok_or_else(nowhere)
}

/// Where the mask of a view lies in its folder: as the image lies in the dataset's.
fn path(data: &Dataset, view: &View) -> PathBuf {
    let inside = match (&view.source, &data.root) {
        (PhotoSource::Files { image, .. }, Some(root)) => image.strip_prefix(root).ok(),
        _ => None,
    };
    let stays_inside = |path: &&Path| path.components().all(|c| matches!(c, Component::Normal(_)));
    inside.filter(stays_inside).unwrap_or(Path::new(&view.name)).with_extension("png")
}

/// The file of each view's mask. Refuses two views with one file.
pub(super) fn targets(data: &Dataset, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let all: Vec<PathBuf> = data.views.iter().map(|view| out.join(path(data, view))).collect();
    let mut sorted: Vec<&PathBuf> = all.iter().collect();
    sorted.sort();
    match sorted.windows(2).find(|two| two[0] == two[1]) {
        None => Ok(all),
        Some(two) => {
            Err(Exit::BadInput.because(format!(
                "two photographs would share the mask {}; give their files different names, or put them into the dataset's folder",
                two[0].display()
            )))
        }
    }
}
