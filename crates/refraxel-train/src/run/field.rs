//! What a checkpoint keeps of the field and the background.

use super::contents::RunRef;
use super::header::{Header, StoredBackground};
use super::tensors::Tensors;
use crate::checkpoint::{CheckpointError, Rows, Tensor, TensorData};
use refraxel_core::{Background, BrickMap, EnvironmentMap, ShDegree, VoxelField};

/// Bricks, occupied cells, density, colour, background, and their moments: straight from memory. Colour is stored without
/// its padding, and in half precision once a run is finished.
pub(super) fn tensors<'a>(run: &RunRef<'a>) -> Vec<(String, Tensor<'a>)> {
    let (field, optimiser) = (&run.model.field, run.optimiser);
    let real = |values: &'a [f32]| TensorData::F32(values.into());
    let (bricks, texels) = (field.map.bricks().as_flattened(), texels(&run.model.background));
    let (stride, kept, half) = (field.degree.stride(), 3 * field.degree.basis(), run.is_finished());
    let colour = Rows { values: &field.colour, stride, kept, half };
    let voxels = field.map.voxels();
    let tensors = [
        ("bricks", vec![bricks.len() / 3, 3], TensorData::U32(bricks.into())),
        ("occupied", vec![field.map.slots()], TensorData::U64((&optimiser.occupied).into())),
        ("density", vec![voxels], real(&field.density)),
        ("colour", vec![voxels, kept], TensorData::Rows(colour)),
        ("density_moment", vec![voxels], real(&optimiser.density)),
        ("colour_moment", vec![voxels], real(&optimiser.colour)),
        ("background", vec![texels.len() / 3, 3], real(texels)),
        ("background_moment", vec![texels.len() / 3, 3], real(optimiser.background.as_flattened())),
    ];
    tensors.map(|(name, shape, data)| (name.to_owned(), Tensor::new(shape, data))).into()
}

fn texels(background: &Background<f32>) -> &[f32] {
    match background {
        Background::Constant(_) => &[],
        Background::Environment(map) => map.texels.as_flattened(),
    }
}

/// Refuses grids that no run has: 2048³ nodes already need a table of half a gigabyte.
pub(super) fn check_resolution(h: &Header, file: &Tensors) -> Result<(), CheckpointError> {
    let valid = |r: &[u32; 3]| r.iter().all(|n| (2..=2048).contains(n));
    let is_valid = valid(&h.resolution) && valid(&h.finest_resolution);
    if is_valid { Ok(()) } else { Err(file.wrong("its resolution is not 2 to 2048 per axis")) }
}

/// The field of a checkpoint.
pub(super) fn restore(h: &Header, file: &mut Tensors) -> Result<VoxelField<f32>, CheckpointError> {
    let degree = ShDegree::new(h.sh_degree).ok_or_else(|| file.wrong("its SH degree is not 0 to 3"))?;
    let domain = h.domain();
    let map = BrickMap::with_bricks(h.resolution, file.triples("bricks")?)
        .ok_or_else(|| file.wrong("a brick lies outside the grid or occurs twice"))?;
    let density = file.aligned("density", map.voxels())?;
    let density = file.finite("density", density)?;
    let colour = file.rows("colour", map.voxels(), 3 * degree.basis(), degree.stride())?;
    let colour = file.finite("colour", colour)?;
    Ok(VoxelField { domain, map, degree, density, colour })
}

/// The background of a checkpoint, and the moments of its texels.
pub(super) fn restore_background(
    h: &Header,
    file: &mut Tensors,
) -> Result<(Background<f32>, Vec<[f32; 3]>), CheckpointError> {
    let rows = if let StoredBackground::EnvironmentRows(n) = h.background { n } else { 0 };
    if rows > 2048 {
        return Err(file.wrong("its panorama has more than 2048 rows"));
    }
    let texels = file.f32s("background", 6 * rows * rows)?;
    let texels = file.finite("background", texels)?.as_chunks().0.to_vec();
    let moments = file.mean_squares("background_moment", 6 * rows * rows)?.as_chunks().0.to_vec();
    let background = match h.background {
        StoredBackground::Constant(c) if c.iter().all(|c| c.is_finite()) => Background::Constant(c),
        StoredBackground::Constant(_) => return Err(file.wrong("the colour of its background is not finite")),
        StoredBackground::EnvironmentRows(n) => Background::Environment(
            EnvironmentMap::from_texels(n, texels).ok_or_else(|| file.wrong("its panorama has no rows"))?,
        ),
    };
    Ok((background, moments))
}
