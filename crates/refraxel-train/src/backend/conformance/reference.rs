//! The reference in double precision.

use super::scenes::objective;
use crate::model::Model;
use refraxel_core::field::Matter;
use refraxel_core::optics::{Options, Tracer};
use refraxel_core::radiance::{QuadraturePoint, Segment, quadrature, thinned, thinning_phase};
use refraxel_core::sh::MAX_BASIS;
use refraxel_core::{AlignedVec, Background, EnvironmentMap, Medium, Path, Ray, Vec3, VoxelField};

/// A model in f64, straight and bent.
#[derive(Clone)]
pub(super) struct Reference {
    pub field: VoxelField<f64>,
    pub background: Background<f64>,
    pub medium: Medium<f64>,
}

/// What a straight ray meets at a quadrature point.
pub(super) struct Sample {
    pub x: Vec3<f64>,
    pub dt: f64,
    pub colour: [f64; 3],
    pub alpha: f64,
    /// Transmittance before it.
    pub before: f64,
}

/// A path and its quadrature points.
pub(super) struct Marched {
    pub path: Path<f64>,
    pub points: Vec<QuadraturePoint<f64>>,
}

impl Reference {
    pub(super) fn new(model: &Model) -> Self {
        let f = &model.field;
        let wide = |v: &[f32]| AlignedVec::from_slice(&v.iter().map(|&v| f64::from(v)).collect::<Vec<_>>());
        let background = match &model.background {
            Background::Constant(c) => Background::Constant(c.map(f64::from)),
            Background::Environment(m) => {
                let texels = m.texels.iter().map(|t| t.map(f64::from)).collect();
                Background::Environment(EnvironmentMap::from_texels(m.height(), texels).unwrap())
            }
        };
        let field = VoxelField {
            domain: f.domain.cast(),
            map: f.map.clone(),
            degree: f.degree,
            density: wide(&f.density),
            colour: wide(&f.colour),
        };
        Self { field, background, medium: model.refraction.medium.cast() }
    }

    pub(super) fn tracer(&self) -> Tracer<'_, f64> {
        Tracer::new(&self.medium, &self.field.domain, Options::default())
    }

    /// Length of a step of [`objective`] [scene unit].
    fn step(&self) -> f64 {
        f64::from(objective().marching.step) * self.field.domain.voxel()
    }

    /// A straight ray inside the grid.
    pub(super) fn straight(
        &self,
        ray: &Ray<f32>,
        offset: f32,
    ) -> Option<(Segment<f64>, Vec<QuadraturePoint<f64>>)> {
        let s = Segment::straight(&ray.cast(), &self.field.domain, 0.0)?;
        Some((s, quadrature(&self.field.domain, &[s], self.step(), f64::from(offset))))
    }

    /// The points on a path that are left where thin matter is sampled by chance; none if another phase, off by rounding, may leave
    /// others.
    pub(super) fn thinned(
        &self,
        path: &[Segment<f64>],
        points: &[QuadraturePoint<f64>],
        thin: f32,
        offset: f32,
    ) -> Option<Vec<QuadraturePoint<f64>>> {
        const OFF: f64 = 0.01;
        let phase = f64::from(thinning_phase(offset));
        let [left, less, more] = [0.0, -OFF, OFF]
            .map(|off| thinned(&self.field, path, points, f64::from(thin), (phase + off).clamp(0.0, 1.0)));
        (left == less && left == more).then_some(left)
    }

    /// What a straight ray meets, from the front; `y` is the basis in its direction.
    pub(super) fn samples(
        &self,
        s: &Segment<f64>,
        points: &[QuadraturePoint<f64>],
        y: &[f64; MAX_BASIS],
    ) -> Vec<Sample> {
        let mut before = 1.0;
        let sample = |q: &QuadraturePoint<f64>| {
            let x = s.at(q.t);
            let Matter { density, colour } = self.field.at(x, y)?;
            let sample = Sample { x, dt: q.dt, colour, alpha: -(-density * q.dt).exp_m1(), before };
            before *= 1.0 - sample.alpha;
            Some(sample)
        };
        points.iter().filter_map(sample).collect()
    }

    /// A ray that may bend.
    pub(super) fn march(&self, ray: &Ray<f32>, offset: f32) -> Marched {
        let path = self.tracer().trace(&ray.cast());
        let points = quadrature(&self.field.domain, &path.segments, self.step(), f64::from(offset));
        Marched { path, points }
    }
}
