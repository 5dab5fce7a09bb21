//! What a checkpoint keeps of the field and the background.

use super::contents::RunRef;
use super::header::{Header, StoredBackground};
use super::tensors::Tensors;
use crate::checkpoint::{CheckpointError, DataView, Rows, TensorView};
use refraxel_core::{Background, BrickMap, EnvironmentMap, ShDegree, VoxelField};

/// The shapes of the tensors, slowest axis first.
pub(super) struct Shapes {
    bricks: [usize; 2],
    slots: [usize; 1],
    voxels: [usize; 1],
    channels: [usize; 2],
    texels: [usize; 2],
}

impl Shapes {
    pub(super) fn of(run: &RunRef) -> Self {
        let field = &run.model.field;
        let voxels = field.map.voxels();
        Self {
            bricks: [field.map.bricks().len(), 3],
            slots: [field.map.slots()],
            voxels: [voxels],
            channels: [voxels, 3 * field.degree.basis()],
            texels: [texels(&run.model.background).len() / 3, 3],
        }
    }

    /// Bricks, occupied cells, density, colour, background, and their moments: straight from memory. Colour is stored without
    /// its padding, and in half precision once a run is finished.
    pub(super) fn tensors<'a>(&'a self, run: &RunRef<'a>) -> Vec<(&'static str, TensorView<'a>)> {
        let (field, optimiser) = (&run.model.field, run.optimiser);
        let real = |shape, values| TensorView::new(shape, DataView::F32(values));
        let (stride, kept, half) = (field.degree.stride(), 3 * field.degree.basis(), run.is_finished());
        let colour = Rows { values: &field.colour, stride, kept, half };
        vec![
            ("bricks", TensorView::new(&self.bricks, DataView::U32(field.map.bricks().as_flattened()))),
            ("occupied", TensorView::new(&self.slots, DataView::U64(&optimiser.occupied))),
            ("density", real(&self.voxels, &field.density)),
            ("colour", TensorView::new(&self.channels, DataView::Rows(colour))),
            ("density_moment", real(&self.voxels, &optimiser.density)),
            ("colour_moment", real(&self.voxels, &optimiser.colour)),
            ("background", real(&self.texels, texels(&run.model.background))),
            ("background_moment", real(&self.texels, optimiser.background.as_flattened())),
        ]
    }
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
