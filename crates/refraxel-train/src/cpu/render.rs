//! Kernels are chosen for the machine and the size of a voxel, and rays are shared out to threads.

use super::passes::render_chunk;
use super::scene::Scene;
use crate::backend::Marching;
use fearless_simd::Level;
use rayon::prelude::*;
use refraxel_core::Ray;
use refraxel_core::radiance::Pixel;

/// Rays of a chunk, the unit of work of a thread. Part of the arithmetic: it fixes the order of sums.
pub(super) const CHUNK: usize = 256;

/// Run a kernel that is generic over the instruction set and over the number of 16-lane blocks of a voxel, for voxels of
/// `stride` lanes.
macro_rules! with_blocks {
    ($level:expr, $stride:expr, $simd:ident, $kernel:ident ( $($arg:expr),* $(,)? )) => {
        match $stride / $crate::cpu::layout::LANES {
            1 => fearless_simd::dispatch!($level, $simd => $kernel::<_, 1>($simd, $($arg),*)),
            2 => fearless_simd::dispatch!($level, $simd => $kernel::<_, 2>($simd, $($arg),*)),
            _ => fearless_simd::dispatch!($level, $simd => $kernel::<_, 3>($simd, $($arg),*)),
        }
    };
}

pub(super) use with_blocks;

/// Renders a scene on the threads of the CPU.
#[derive(Clone, Copy)]
pub(super) struct Renderer<'a> {
    pub level: Level,
    pub scene: Scene<'a>,
}

impl Renderer<'_> {
    /// What rays show.
    pub(super) fn render(&self, rays: &[Ray<f32>], marching: &Marching) -> Vec<Pixel<f32>> {
        let mut out = vec![Pixel { colour: [0.0; 3], transmittance: 1.0, depth: 0.0 }; rays.len()];
        let (scene, stride) = (&self.scene, self.scene.field.degree.stride());
        rays.par_chunks(CHUNK).zip(out.par_chunks_mut(CHUNK)).for_each(|(rays, out)| {
            with_blocks!(self.level, stride, simd, render_chunk(scene, rays, marching, out));
        });
        out
    }
}
