//! Photographs of a room, in the layout of nerfstudio.

use super::description::{write_json, write_scene};
use super::plan::Plan;
use crate::part::Part;
use crate::synth::cameras::opengl_matrix;
use crate::synth::dataset::{Cost, PlannedView};
use crate::synth::error::SynthError;
use crate::synth::hash::mix;
use crate::synth::output::contact::contact_sheet;
use crate::synth::output::files::write_whole;
use crate::synth::output::options::SynthOptions;
use crate::synth::output::pictures::{color_jpeg, color_png, mask_png};
use crate::synth::photographic::{
    EXPOSURE, Imperfection, Imperfections, JPEG_QUALITY, LENS_RADIUS, MaskOf, POSITION_ERROR, READ_NOISE,
    Sensor, TURN_ERROR, WANDER, WHITE_ELECTRONS, developed, drawn, estimated, lens_of, mask_of, seen,
};
use crate::synth::render::{Frame, Sampling, refracts, render_through};
use crate::synth::scenes::Room;
use crate::synth::trace::Limits;
use refraxel_core::Camera;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Rays that carry less than this share of a sample are not followed: one step of 8 bits.
const ENERGY_CUT: f64 = 1.0 / 255.0;

/// Photographs that are to be taken of a room.
pub(super) struct Photographs<'a> {
    options: &'a SynthOptions,
    with: Imperfections,
    room: Room,
    views: Vec<PlannedView>,
    refracts: bool,
}

/// What random numbers are drawn for.
#[derive(Clone, Copy)]
enum Draw {
    Sensor,
    Pose,
    Mask,
    MaskOf,
}

impl<'a> Photographs<'a> {
    pub(super) fn new(options: &'a SynthOptions, with: Imperfections) -> Result<Self, SynthError> {
        let room = options.room()?;
        let of_part = |part: Part| {
            let seed = mix(options.seed, 100 + part as u64);
            let cameras = room.viewpoints.cameras(options.views.of(part), seed, options.picture_size());
            cameras.into_iter().enumerate().map(move |(index, camera)| PlannedView { part, index, camera })
        };
        let views = Part::ALL.into_iter().flat_map(of_part).collect();
        let refracts = refracts(&room.scene);
        Ok(Photographs { options, with, room, views, refracts })
    }

    fn sampling(&self) -> Sampling {
        let SynthOptions { spp, detail_spp, seed, reflection, .. } = *self.options;
        Sampling {
            spp,
            detail_spp,
            seed,
            limits: Limits { reflection, energy_cut: ENERGY_CUT, ..Limits::default() },
        }
    }

    fn seed(&self, draw: Draw, view: &PlannedView) -> u64 {
        mix(mix(self.options.seed, 500 + draw as u64), view.number())
    }

    fn sensor(&self, view: &PlannedView) -> Sensor {
        Sensor::new(self.with, self.seed(Draw::Sensor, view))
    }

    /// The camera that the dataset states.
    fn stated(&self, view: &PlannedView) -> Camera {
        if !self.with.has(Imperfection::Poses) {
            return view.camera;
        }
        estimated(&view.camera, self.room.viewpoints.target, self.seed(Draw::Pose, view))
    }

    /// Whether the mask of a view is drawn; those of test views are exact.
    fn is_drawn(&self, view: &PlannedView) -> bool {
        self.with.has(Imperfection::Masks) && view.part == Part::Train
    }

    /// Whose mask a view has.
    fn mask_of(&self, view: &PlannedView) -> MaskOf {
        if !self.refracts {
            return MaskOf::Nothing;
        }
        let seed = mix(self.options.seed, 500 + Draw::MaskOf as u64);
        if self.is_drawn(view) { mask_of(view.index, self.options.views.train, seed) } else { MaskOf::Own }
    }

    fn picture_file(&self, view: &PlannedView) -> String {
        let extension = if self.with.has(Imperfection::Jpeg) { "jpg" } else { "png" };
        format!("{}/r_{}.{extension}", view.part.name(), view.index)
    }

    fn mask_file(&self, view: &PlannedView) -> String {
        format!("masks/{}/r_{}.png", view.part.name(), view.index)
    }

    fn write_mask(&self, view: &PlannedView, frame: &Frame) -> Result<(), SynthError> {
        let of = match self.mask_of(view) {
            MaskOf::Nothing => return Ok(()),
            MaskOf::Own => view,
            // Training views come first.
            MaskOf::Other(index) => &self.views[index],
        };
        let mask = if self.is_drawn(view) {
            drawn(&seen(&self.room.scene, &of.camera), self.seed(Draw::Mask, view))
        } else {
            frame.mask()
        };
        let path = self.options.out.join(self.mask_file(view));
        write_whole(&path, &mask_png(&path, &mask)?)
    }

    fn transforms(&self, parts: &[Part]) -> Value {
        let [w, h] = self.options.picture_size();
        let mut all = json!({
            "camera_model": "OPENCV", "w": w, "h": h, "k1": 0, "k2": 0, "p1": 0, "p2": 0, "frames": [],
        });
        if let Some(Camera { focal, center, .. }) = self.views.first().map(|v| v.camera) {
            all["fl_x"] = json!(focal[0]);
            all["fl_y"] = json!(focal[1]);
            all["cx"] = json!(center[0]);
            all["cy"] = json!(center[1]);
        }
        let frame = |view: &PlannedView| {
            let mut frame = json!({
                "file_path": self.picture_file(view),
                "transform_matrix": opengl_matrix(&self.stated(view)),
            });
            if self.mask_of(view) != MaskOf::Nothing {
                frame["mask_path"] = json!(self.mask_file(view));
            }
            frame
        };
        all["frames"] = self.views.iter().filter(|v| parts.contains(&v.part)).map(frame).collect();
        all
    }

    /// What is true of each photograph.
    fn truth_json(&self) -> Value {
        let mask = |view: &PlannedView| match self.mask_of(view) {
            MaskOf::Nothing => json!(null),
            MaskOf::Own if self.is_drawn(view) => json!("drawn"),
            MaskOf::Own => json!("exact"),
            MaskOf::Other(index) => json!(format!("of {}", self.picture_file(&self.views[index]))),
        };
        let frame = |view: &PlannedView| {
            json!({
                "file_path": self.picture_file(view),
                "transform_matrix": opengl_matrix(&view.camera),
                "gains": self.sensor(view).gains,
                "mask": mask(view),
            })
        };
        json!({
            "imperfections": self.with.names(),
            "exposure": EXPOSURE,
            "white_electrons": WHITE_ELECTRONS,
            "read_noise_electrons": READ_NOISE,
            "jpeg_quality": JPEG_QUALITY,
            "turn_error_degrees": TURN_ERROR,
            "position_error_of_distance": POSITION_ERROR,
            "lens_radius_of_distance": LENS_RADIUS,
            "mask_wander_pixels": WANDER,
            "frames": self.views.iter().map(frame).collect::<Vec<_>>(),
        })
    }
}

impl Plan for Photographs<'_> {
    type Job = PlannedView;

    fn parameters(&self) -> Value {
        self.options.parameters(&self.room.scene)
    }

    fn jobs(&self) -> Vec<PlannedView> {
        self.views.clone()
    }

    fn folders(&self) -> Vec<String> {
        let parts = self.options.views.parts();
        let masks = |part: Part| self.refracts.then(|| format!("masks/{}", part.name()));
        parts.flat_map(|p| masks(p).into_iter().chain([p.name().to_owned()])).collect()
    }

    fn picture(&self, view: &PlannedView) -> PathBuf {
        self.options.out.join(self.picture_file(view))
    }

    fn render_one(&self, view: &PlannedView) -> Result<Cost, SynthError> {
        let lens =
            self.with.has(Imperfection::Focus).then(|| lens_of(&view.camera, self.room.viewpoints.target));
        let frame = render_through(lens, &self.room.scene, &view.camera, view.number(), &self.sampling());
        self.write_mask(view, &frame)?;
        let (image, path) = (developed(&frame, &self.sensor(view)), self.picture(view));
        let bytes = match self.with.has(Imperfection::Jpeg) {
            true => color_jpeg(&path, &image, JPEG_QUALITY)?,
            false => color_png(&path, &image)?,
        };
        write_whole(&path, &bytes)?;
        Ok(Cost::of_frame(&frame))
    }

    fn write_truth(&self) -> Result<(), SynthError> {
        let out = &self.options.out;
        let own = json!({ "lighting": "emissive textures; colours are basic radiance L/n^2" });
        write_scene(self.options, &self.room.scene, own)?;
        write_json(&out.join("photographs.json"), &self.truth_json())?;
        let (path, cameras) =
            (out.join("contact.png"), self.views.iter().map(|v| v.camera).collect::<Vec<_>>());
        let sheet = contact_sheet(&self.room.scene, &cameras, &self.sampling());
        write_whole(&path, &color_png(&path, &sheet)?)?;
        write_json(&out.join("transforms.json"), &self.transforms(&Part::ALL))?;
        for part in self.options.views.parts() {
            write_json(&out.join(format!("transforms_{}.json", part.name())), &self.transforms(&[part]))?;
        }
        Ok(())
    }
}
