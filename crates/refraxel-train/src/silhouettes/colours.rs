//! The colour that a scene with surroundings starts with, theory (4.20).

use crate::model::Model;
use crate::rays::Picture;
use rayon::prelude::*;
use refraxel_core::{Background, Vec3, sh};

/// Cells of a photograph along each edge whose means are averaged: those with unused pixels are left out.
const CELLS: usize = 16;

/// The mean colour of photographs, each of which counts once; `None` where none has pixels that may be used.
pub fn mean_colour<'a>(pictures: impl Iterator<Item = Picture<'a>>) -> Option<[f32; 3]> {
    let pictures: Vec<Picture> = pictures.collect();
    let colour = |[r, g, b, _]: [f32; 4]| [r, g, b]; // pictures of surroundings are not transparent
    let of_one = |p: &Picture| mean(p.reduced(cells(p)).into_iter().flatten().map(colour));
    let each: Vec<[f32; 3]> = pictures.par_iter().filter_map(of_one).collect();
    mean(each.into_iter())
}

/// Cells of a picture: no more than it has pixels.
fn cells(picture: &Picture) -> [usize; 2] {
    [picture.camera.width, picture.camera.height].map(|n| CELLS.min(n as usize))
}

fn mean(colours: impl Iterator<Item = [f32; 3]>) -> Option<[f32; 3]> {
    let add = |(sum, n): ([f64; 3], f64), colour: [f32; 3]| {
        ([0, 1, 2].map(|c| sum[c] + f64::from(colour[c])), n + 1.0)
    };
    let (sum, count) = colours.fold(([0.0; 3], 0.0), add);
    (count > 0.0).then(|| sum.map(|s| (s / count) as f32))
}

/// Gives the field, seen from anywhere, and a panorama behind it one colour, theory (4.20). Density stays as it is.
pub fn paint(model: &mut Model, colour: [f32; 3]) {
    let field = &mut model.field;
    let (stride, basis) = (field.degree.stride(), field.degree.basis());
    let constant = sh::basis(field.degree, Vec3::new(0.0_f32, 0.0, 1.0))[0];
    for coefficients in field.colour.chunks_exact_mut(stride) {
        (0..3).for_each(|c| coefficients[c * basis] = (colour[c] - 0.5) / constant);
    }
    field.clear_empty_brick();
    if let Background::Environment(map) = &mut model.background {
        map.texels.fill(colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::RaySampler;
    use refraxel_core::{Aabb, BrickMap, Camera, Domain, EnvironmentMap, Extent, ShDegree, VoxelField, vec3};
    use refraxel_data::{Backdrop, Image, Photo, Pixels, View};

    #[test]
    fn a_painted_model_shows_its_colour_in_every_direction() {
        let bounds = Aabb::cube(1.0);
        let domain = Domain::with_longest(bounds, Extent::Contracted, 8);
        let map = BrickMap::dense(domain.resolution);
        let field = VoxelField::uniform(domain, map, ShDegree::new(2).unwrap(), -5.0);
        let mut model = Model::straight(field, Background::Environment(EnvironmentMap::uniform(4, [0.5; 3])));
        let (before, colour) = (model.field.density.clone(), [0.1, 0.2, 0.7]);
        paint(&mut model, colour);
        let is_near = |found: [f32; 3]| (0..3).all(|c| (found[c] - colour[c]).abs() < 1e-6);
        for d in [vec3(0.0, 0.0, 1.0), vec3(0.6, -0.8, 0.0)] {
            let matter = model.field.at(vec3(0.1, 0.2, -0.3), &sh::basis(model.field.degree, d)).unwrap();
            assert!(is_near(matter.colour), "{:?}", matter.colour);
            assert!(is_near(model.background.radiance(Vec3::zero(), d)));
        }
        assert!(before == model.field.density);
    }

    #[test]
    fn every_photograph_counts_once_whatever_its_size() {
        let photo = |width: u32, value: u8| {
            let eye = vec3(f64::from(value), 0.0, 3.0);
            let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 1.0, 0.0), 0.7, [width, 20]);
            let pixels = Pixels::U8([value, 2 * value, 0].repeat((width * 20) as usize));
            let image = Image { width, height: 20, channels: 3, pixels };
            (View::of_file("a", camera), Photo::new(image, None))
        };
        let (views, photos) = [photo(30, 51), photo(10, 102)].into_iter().unzip();
        let sampler = RaySampler::new(views, photos, Backdrop::Surroundings, 0);
        const TOL: f32 = 3e-6; // the cells' means are f32 sums of a few pixels
        let found = mean_colour(sampler.pictures()).unwrap();
        for (found, expected) in found.into_iter().zip([0.3, 0.6, 0.0]) {
            assert!((found - expected).abs() < TOL, "{found} {expected}");
        }
    }
}
