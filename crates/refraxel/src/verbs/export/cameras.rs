//! The cameras of a run as `transforms.json` in the layout of nerfstudio and instant-ngp, with poses and lenses as learned.

use crate::exit::{Exit, Failure};
use crate::verbs::files::absolute;
use crate::verbs::render::intrinsics;
use refraxel_core::{Camera, Lens};
use refraxel_data::synth::opengl_matrix;
use refraxel_data::{Backdrop, Dataset, PhotoSource, View};
use refraxel_train::alignment::Alignment;
use serde_json::{Map, Value, json};
use std::path::Path;

/// The text of a file that will lie in `folder`. Photographs are named by their whole files: what was cut off them or reduced
/// while they were read is in them again.
pub fn transforms(data: &Dataset, alignment: &Alignment, folder: &Path) -> Result<String, Failure> {
    let folder = absolute(folder);
    let name = |path: &Path| {
        let path = absolute(path);
        path.strip_prefix(&folder).map_or(path.clone(), Path::to_owned).display().to_string()
    };
    let mut frames = Vec::new();
    for (view, camera) in data.views.iter().zip(alignment.cameras(data)) {
        let camera = data.origin.to_world(camera);
        let PhotoSource::Files { image, mask, .. } = &view.source else {
            return Err(Exit::BadInput
                .because(format!("{}: the photograph is in memory, and no file can be named", view.name)));
        };
        let camera = view.camera_of_files(&camera);
        let mut frame = Map::from_iter([
            ("file_path".to_owned(), json!(name(image))),
            ("transform_matrix".to_owned(), json!(opengl_matrix(&camera))),
        ]);
        frame.extend(mask.as_deref().map(|mask| ("mask_path".to_owned(), json!(name(mask)))));
        frame.extend(named_intrinsics(view, &camera)?);
        frames.push(Value::Object(frame));
    }
    let split = &data.split;
    let files = |indices: &[usize]| -> Vec<Value> {
        indices.iter().map(|&i| frames[i]["file_path"].clone()).collect()
    };
    let mut all = json!({
        "train_filenames": files(&split.train),
        "val_filenames": files(&split.val),
        "test_filenames": files(&split.test),
        "frames": frames,
    });
    match data.backdrop {
        Backdrop::Transparent => all["background"] = json!("transparent"),
        Backdrop::Color(colour) => all["background"] = json!(colour.map(|c| f64::from(c) * 255.0)),
        Backdrop::Surroundings => {}
    }
    if let Some(bounds) = data.stated_box.map(|b| data.origin.to_world(b)) {
        all["aabb"] = json!(bounds.to_arrays());
    }
    Ok(format!("{all:#}\n"))
}

/// The keys of a camera, if there is a name for its lens.
fn named_intrinsics(view: &View, camera: &Camera) -> Result<Map<String, Value>, Failure> {
    if let Lens::Fov { .. } | Lens::ThinPrismFisheye { .. } = camera.lens {
        return Err(Exit::BadInput
            .because(format!("{}: transforms.json has no name for the lens {:?}", view.name, camera.lens)));
    }
    Ok(intrinsics(camera))
}
