//! What a dataset says beside its pictures: cameras, shapes, indices and the protocol.

use super::renderings::Renderings;
use crate::part::Part;
use crate::synth::cameras::opengl_matrix;
use crate::synth::dataset::ANGLE;
use crate::synth::error::SynthError;
use crate::synth::output::contact::contact_sheet;
use crate::synth::output::files::write_whole;
use crate::synth::output::npz::npz_of_index;
use crate::synth::output::options::SynthOptions;
use crate::synth::output::pictures::{DEPTH_UNIT, color_png};
use crate::synth::scene::{Environment, Scene};
use crate::synth::trace::Reflection;
use crate::synth::truth::{IndexTruth, opaque_json, refractive_json};
use refraxel_core::Camera;
use serde_json::{Value, json};
use std::path::Path;

impl Renderings<'_> {
    /// Writes everything but the pictures.
    pub(super) fn describe(&self) -> Result<(), SynthError> {
        let out = &self.options.out;
        write_scene(self.options, &self.scene, self.scene_json())?;
        let path = out.join("contact.png");
        let cameras = self.dataset.split_cameras(&self.scene, Part::Test);
        write_whole(
            &path,
            &color_png(&path, &contact_sheet(&self.scene, &cameras, &self.dataset.sampling))?,
        )?;
        for part in self.options.views.parts() {
            let name = part.name();
            write_json(&out.join(format!("transforms_{name}.json")), &self.transforms(part, name))?;
        }
        if self.twin.is_some() && self.options.views.test > 0 {
            write_json(&out.join("transforms_test_bg.json"), &self.transforms(Part::Test, "test_bg"))?;
        }
        Ok(())
    }

    fn transforms(&self, part: Part, folder: &str) -> Value {
        let frame = |(i, camera): (usize, &Camera)| json!({ "file_path": format!("./{folder}/r_{i}"), "transform_matrix": opengl_matrix(camera) });
        let frames: Vec<Value> =
            self.dataset.split_cameras(&self.scene, part).iter().enumerate().map(frame).collect();
        let size = self.options.size;
        let mut all = json!({ "camera_angle_x": ANGLE, "w": size, "h": size });
        if let Some(background) = self.scene.background() {
            all["background"] = json!(background);
        }
        all["frames"] = Value::Array(frames);
        all
    }

    /// What `scene.json` says of renderings alone.
    fn scene_json(&self) -> Value {
        let linear = match self.scene.environment {
            Environment::Constant(c) => json!(c),
            Environment::Sky { .. } | Environment::Landscape { .. } => Value::Null,
        };
        json!({
            "energy_cut": self.dataset.sampling.limits.energy_cut,
            "camera_angle_x": ANGLE,
            "camera_elevations": self.dataset.cameras.elevations(&self.scene).degrees(),
            "pixel_filter": "box, averaged in linear light then sRGB-encoded",
            "near": 2.0,
            "far": 6.5,
            "image_mode": "RGB",
            "background_srgb8": self.scene.background(),
            "background_linear": linear,
            "lighting": "emissive textures only (opaque surfaces without glaze_ior look the same from everywhere); colours are basic radiance L/n^2",
            "files": {
                "masks": "8-bit coverage (0..255) of the refractive object as first thing seen",
                "test_bg": "same cameras as test, refractive objects removed",
                "depth": format!("16-bit, {DEPTH_UNIT} scene units along the optical axis at the pixel centre, 0 = background"),
                "normals": "16-bit, 65535 (n + 1) / 2, world axes, facing the camera, 0 = background",
            },
        })
    }
}

/// Writes `scene.json`: what it says of every dataset, what is its `own`, and the index as voxels beside it.
pub(super) fn write_scene(options: &SynthOptions, scene: &Scene, own: Value) -> Result<(), SynthError> {
    let mut all = json!({
        "name": scene.name,
        "note": scene.shows,
        "renderer": concat!("refraxel ", env!("CARGO_PKG_VERSION"), " exact tracer, float64"),
        "resolution": options.picture_size(),
        "spp": options.spp,
        "detail_spp": options.detail_spp,
        "seed": options.seed,
        "reflection": if options.reflection == Reflection::On { "fresnel" } else { "off" },
        "up_axis": "z",
        "aabb": scene.bounds.to_arrays(),
        "refractive": refractive_json(scene),
        "opaque": opaque_json(scene),
    });
    if let (Some(all), Value::Object(own)) = (all.as_object_mut(), own) {
        all.extend(own);
    }
    if let Some(field) = write_index(options, scene)? {
        all["index_field"] = field;
    }
    write_json(&options.out.join("scene.json"), &all)
}

/// Writes the index as voxels, where there is one and voxels are asked for; what `scene.json` says of them.
fn write_index(options: &SynthOptions, scene: &Scene) -> Result<Option<Value>, SynthError> {
    let Some(truth) = IndexTruth::of_scene(scene).filter(|_| options.index_resolution > 0) else {
        return Ok(None);
    };
    let (bounds, longest) = (scene.bounds, options.index_resolution);
    let e = bounds.extent();
    let cells = e.to_array().map(|l| ((l / e.max_element() * f64::from(longest)).round() as usize).max(1));
    let bytes = npz_of_index(&bounds, cells, &truth.voxels(&bounds, cells));
    write_whole(&options.out.join("index.npz"), &bytes)?;
    Ok(Some(json!({
        "file": "index.npz",
        "cells": cells,
        "layout": "n[x, y, z] float32 at cell centres min + (i + 1/2) (max - min) / cells; z runs fastest",
    })))
}

pub(super) fn write_json(path: &Path, value: &Value) -> Result<(), SynthError> {
    // Serialising a Value cannot fail: its keys are strings and its numbers finite.
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    write_whole(path, text.as_bytes())
}
