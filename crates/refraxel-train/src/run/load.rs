//! From a checkpoint back to its run.

use super::contents::Run;
use super::header::Header;
use super::save::CHECKPOINT;
use super::source::Source;
use super::tensors::Tensors;
use super::{clearcoat, detected, field, reflection, refraction, views};
use crate::checkpoint::{CheckpointError, TensorFile};
use crate::model::{Model, Optimiser};
use crate::refraction_search::MASK_MARGIN;
use refraxel_core::AlignedVec;
use refraxel_data::LocalOrigin;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Moments of the voxels: as large as their densities, and needed for training alone.
const MOMENTS: [&str; 2] = ["density_moment", "colour_moment"];

impl Run {
    /// Read a run back from its folder.
    pub fn load(folder: &Path) -> Result<Self, CheckpointError> {
        let path = folder.join(CHECKPOINT);
        Self::restore(Tensors::new(TensorFile::load(&path)?, path), &[])
    }

    /// The same with moments of voxels that are zero, for whoever renders the run and neither trains nor saves it.
    pub fn load_to_render(folder: &Path) -> Result<Self, CheckpointError> {
        let path = folder.join(CHECKPOINT);
        Self::restore(Tensors::new(TensorFile::load_without(&path, &MOMENTS)?, path), &MOMENTS)
    }

    /// What a run was trained on, and where its coordinates begin; its parameters are not read.
    pub fn source_of(folder: &Path) -> Result<(Source, LocalOrigin), CheckpointError> {
        let path = folder.join(CHECKPOINT);
        let wrong = |e: serde_json::Error| CheckpointError::Foreign {
            path: path.clone(),
            found: format!("its header does not fit: {e}"),
        };
        let header: Header = serde_json::from_value(TensorFile::load_header(&path)?).map_err(wrong)?;
        let origin = header.plan().origin;
        Ok((header.source, origin))
    }

    /// Read a run back from anywhere; the stream is read to its end.
    pub fn read(from: impl Read) -> Result<Self, CheckpointError> {
        let path = PathBuf::from("(a stream)");
        Self::restore(Tensors::new(TensorFile::read(from, &path)?, path), &[])
    }

    /// A run from its tensors, without some moments.
    fn restore(mut file: Tensors, left_out: &[&str]) -> Result<Self, CheckpointError> {
        let header: Header = serde_json::from_value(file.header())
            .map_err(|e| file.wrong(&format!("its header does not fit: {e}")))?;
        let options = header.options.clone().checked();
        options.map_err(|e| file.wrong(&format!("its options make no sense: {e}")))?;
        // NaN is not within either.
        let most_shift = 2.0 * MASK_MARGIN as f32;
        let is_within = header.state.mask_shift.abs() <= most_shift;
        if !is_within {
            return Err(file.wrong(&format!(
                "it moves masks by {} pixels, at most {most_shift} make sense",
                header.state.mask_shift
            )));
        }
        if header.projection.is_some_and(|p| !p.is_valid()) {
            return Err(file.wrong(
                "the frame of its grid is none: expected unit axes at right angles and lengths above 0",
            ));
        }
        let plan = header.plan();
        field::check_resolution(&header, &file)?;
        plan.check().map_err(|e| file.wrong(&e.to_string()))?;
        let field = field::restore(&header, &mut file)?;
        let (background, texel_moments) = field::restore_background(&header, &mut file)?;
        let (refraction, index) = refraction::restore(&header.regions, &header.options, &mut file)?;
        let (reflection, mirrors) = reflection::restore(&header.reflection, &refraction, &mut file)?;
        let (clearcoat, clearcoat_moments) =
            clearcoat::restore(header.clearcoat.as_ref(), field.domain.bounds, &mut file)?;
        let voxels = field.map.voxels();
        let mut moments = |name| match left_out.contains(&name) {
            true => Ok(AlignedVec::filled(voxels, 0.0)),
            false => file.mean_squares(name, voxels),
        };
        let optimiser = Optimiser {
            density: moments(MOMENTS[0])?,
            colour: moments(MOMENTS[1])?,
            background: texel_moments,
            index,
            reflection: mirrors,
            clearcoat: clearcoat_moments,
            occupied: file.u64s("occupied")?,
        };
        let model = Model { field, background, refraction, reflection, clearcoat };
        if !optimiser.fits(&model) {
            return Err(file.wrong("its occupied cells or moments are not those of its parameters"));
        }
        let detected = detected::restore(header.detected.as_ref(), &mut file)?;
        let alignment = views::restore(&header.views, header.source.train.len(), &mut file)?;
        let Header { options, state, source, .. } = header;
        Ok(Self { options, plan, state, source, model, optimiser, detected, alignment })
    }
}
