//! The picture that convinced: a photograph of a body beside what straight and bent rays should show there.

use super::Photographs;
use super::detail::Detail;
use super::predict::{Way, behind};
use crate::backend::{Backend, Marching};
use crate::model::Refraction;
use refraxel_data::quantize;

/// Grey of pixels of which nothing is known, as beside the mask.
const BLANK: [u8; 3] = [128; 3];

/// One view of a body, cut out around its mask: sRGB, x fastest, all of one size, grey beside the mask and where nobody knows what
/// a ray ends in.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Number of the region, from 0.
    pub region: usize,
    /// Name of the view.
    pub view: String,
    /// Columns and rows.
    pub size: [usize; 2],
    /// Its photograph.
    pub photograph: Vec<[u8; 3]>,
    /// What is seen where one looks straight through, and how alike it is to the photograph, theory (4.24).
    pub straight_through: (Vec<[u8; 3]>, f64),
    /// What bent rays should show, before anything of the body has learned, and how alike that is.
    pub predicted: (Vec<[u8; 3]>, f64),
}

impl Shown {
    /// What a field shows of one view behind a medium, where one looks straight through, and along bent rays; with these scores.
    pub(crate) fn new(
        backend: &dyn Backend,
        marching: &Marching,
        (photographs, view): (&Photographs, usize),
        (medium, [through, bent]): (&Refraction, [f64; 2]),
        region: usize,
    ) -> Option<Self> {
        let cutting = photographs.cuttings(Detail::Fine).get(view)?;
        let raster = |colours: &mut dyn Iterator<Item = Option<[f32; 3]>>| {
            let mut out = vec![BLANK; cutting.luminance.len()];
            for (pixel, colour) in cutting.pixels.iter().zip(colours) {
                out[*pixel] = colour.map_or(BLANK, |c| c.map(quantize));
            }
            out
        };
        let shown = |way, score: f64| {
            let (exits, pixels) = behind(backend, marching, &cutting.rays, medium, way);
            let mut pixels = pixels.iter();
            let mut colours = exits.iter().map(|exit| exit.and_then(|_| pixels.next()).map(|p| p.colour));
            (raster(&mut colours), score)
        };
        Some(Self {
            region,
            view: cutting.name.clone(),
            size: cutting.size,
            photograph: raster(&mut cutting.colours.iter().copied().map(Some)),
            straight_through: shown(Way::Straight, through),
            predicted: shown(Way::Bent, bent),
        })
    }
}
