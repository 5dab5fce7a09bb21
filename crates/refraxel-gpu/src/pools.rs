//! Arrays that are larger than a binding: cut into pools of whole bricks, read and written by generated functions.

use crate::constants::WORKGROUP;
use crate::device::STORAGE_BUFFERS;
use crate::{Gpu, GpuError};
use refraxel_core::ShDegree;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_train::Model;
use std::fmt::Write;

/// Arrays of the kernel with the most of them, without its pools, where all rays are straight, and where they may bend.
const OTHER_BINDINGS: [u32; 2] = [13, 19];

/// How an array with one entry per voxel, or with the words of photographs, is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Split {
    /// Voxels of every pool but the last.
    pub voxels: usize,
    pub pools: usize,
}

impl Split {
    pub(crate) fn new(voxels: usize, bytes_per_voxel: u64, binding: u64) -> Self {
        let most = (binding / bytes_per_voxel) as usize / BRICK_VOXELS * BRICK_VOXELS;
        let most = most.max(BRICK_VOXELS);
        Self { voxels: most, pools: voxels.div_ceil(most).max(1) }
    }

    /// The voxels of a pool, of so many in all.
    pub(crate) fn range(&self, pool: usize, voxels: usize) -> std::ops::Range<usize> {
        pool * self.voxels..((pool + 1) * self.voxels).min(voxels)
    }
}

/// What a field is in the memory of a device for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// It learns: coefficients of colour are f32, and have a gradient.
    Learning,
    /// It is shown: they are f16, as the checkpoints of finished runs have them.
    Showing,
}

/// What kernels are made for: a purpose, a degree of colour, and the pools of colour, of its gradient, and of photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    pub purpose: Purpose,
    pub degree: ShDegree,
    pub colour: Split,
    pub gradient: Split,
    pub photographs: Split,
}

impl Shape {
    /// The shape of a model, if a device can bind it.
    pub(crate) fn new(gpu: &Gpu, model: &Model, purpose: Purpose) -> Result<Self, GpuError> {
        let (binding, voxels) = (gpu.binding_limit(), model.field.map.voxels());
        let shape = Self::within(purpose, model.field.degree, voxels, binding);
        let others = OTHER_BINDINGS[usize::from(!model.refraction.is_none())];
        let (found, needed) = (gpu.adapter().max_bindings, others + 2);
        if found < needed {
            let (adapter, limit) = (gpu.adapter().name.clone(), STORAGE_BUFFERS);
            return Err(GpuError::Unsuitable { adapter, limit, found: found.into(), needed: needed.into() });
        }
        let most = (found - others) as usize;
        let too_large = |what, needed, most| GpuError::too_large(gpu, what, needed, most);
        // The largest array in one piece, and those that are cut, with their bytes per voxel.
        let (colour, gradient) = (shape.colour_bytes(), shape.gradient_bytes());
        let ((whole, whole_bytes), (cut, cut_bytes)) = match purpose {
            Purpose::Learning => {
                (("the gradient of density", 8), ("colour and its gradient", colour + gradient))
            }
            Purpose::Showing => (("density", 4), ("colour", colour)),
        };
        if whole_bytes * voxels as u64 > binding {
            return Err(too_large(whole, whole_bytes * voxels as u64, binding));
        }
        if shape.colour.pools + shape.gradient.pools > most {
            return Err(too_large(cut, cut_bytes * voxels as u64, most as u64 * binding));
        }
        Ok(shape)
    }

    /// The shape of so many voxels in bindings of so many bytes.
    pub(crate) fn within(purpose: Purpose, degree: ShDegree, voxels: usize, binding: u64) -> Self {
        let one = Split { voxels: BRICK_VOXELS, pools: 1 };
        let shape = Self { purpose, degree, colour: one, gradient: one, photographs: one };
        let colour = Split::new(voxels, shape.colour_bytes(), binding);
        let gradient = match purpose {
            Purpose::Learning => Split::new(voxels, shape.gradient_bytes(), binding),
            Purpose::Showing => one,
        };
        Self { colour, gradient, ..shape }
    }

    /// Vectors of four lanes that hold the coefficients of a voxel.
    pub(crate) fn blocks(&self) -> u32 {
        (3 * self.degree.basis()).div_ceil(4) as u32
    }

    /// Lanes of the gradient of a voxel.
    pub(crate) fn lanes(&self) -> usize {
        4 * self.blocks() as usize
    }

    /// Bytes of a voxel's coefficients, laid out as on the host.
    pub(crate) fn colour_bytes(&self) -> u64 {
        let bytes = match self.purpose {
            Purpose::Learning => 4,
            Purpose::Showing => 2,
        };
        bytes * self.degree.stride() as u64
    }

    /// Type of four coefficients of colour in an array.
    pub(crate) fn colour_element(&self) -> &'static str {
        match self.purpose {
            Purpose::Learning => "vec4<f32>",
            Purpose::Showing => "vec2<u32>",
        }
    }

    /// Bytes of the gradient of a voxel's coefficients: fixed point, 8 bytes per lane, without padding to whole lines.
    pub(crate) fn gradient_bytes(&self) -> u64 {
        8 * self.lanes() as u64
    }

    /// `colour_at` and, to write, `set_colour`.
    pub(crate) fn colour_access(&self, writes: bool) -> String {
        let stride = self.degree.stride() / 4;
        let at = format!("    let i = (voxel % {0}u) * {stride}u + block;\n", self.colour.voxels);
        let (read, written) = match self.purpose {
            Purpose::Learning => ("v", "value"),
            Purpose::Showing => (
                "vec4(unpack2x16float(v.x), unpack2x16float(v.y))",
                "vec2(pack2x16float(value.xy), pack2x16float(value.zw))",
            ),
        };
        let mut out = format!("fn colour_at(voxel: u32, block: u32) -> vec4<f32> {{\n{at}");
        self.colour.each(&mut out, "voxel", |k| format!("let v = colour_{k}[i]; return {read};"));
        if writes {
            let _ = write!(out, "fn set_colour(voxel: u32, block: u32, value: vec4<f32>) {{\n{at}");
            self.colour.each(&mut out, "voxel", |k| format!("colour_{k}[i] = {written}; return;"));
        }
        out
    }

    /// `photograph_word(i)`.
    pub(crate) fn photograph_access(&self) -> String {
        let words = self.photographs.voxels;
        let mut out = format!("fn photograph_word(i: u32) -> u32 {{\n    let k = i % {words}u;\n");
        self.photographs.each(&mut out, "i", |k| format!("return photographs_{k}[k];"));
        out
    }

    /// `add_colour_gradient`, or else `take_colour_gradient`.
    pub(crate) fn gradient_access(&self, adds: bool) -> String {
        let names: Vec<String> = (0..self.gradient.pools).map(|k| format!("colour_gradient_{k}")).collect();
        let at =
            format!("    let i = (voxel % {}u) * {}u + 4u * block;\n", self.gradient.voxels, self.lanes());
        let mut out: String = names.iter().map(|n| if adds { add(n) } else { take(n) }).collect();
        if adds {
            let _ = write!(out, "fn add_colour_gradient(voxel: u32, block: u32, d: vec4<f32>) {{\n{at}");
            let lane = |k: usize, l: usize| format!("add_colour_gradient_{k}(i + {l}u, d[{l}]);");
            self.gradient
                .each(&mut out, "voxel", |k| (0..4).map(|l| lane(k, l)).collect::<String>() + "return;");
        } else {
            let _ = write!(out, "fn take_colour_gradient(voxel: u32, block: u32) -> vec4<f32> {{\n{at}");
            let lane = |k: usize, l: usize| format!("take_colour_gradient_{k}(i + {l}u)");
            self.gradient.each(&mut out, "voxel", |k| {
                format!("return vec4<f32>({});", [0, 1, 2, 3].map(|l| lane(k, l)).join(", "))
            });
        }
        out
    }
}

impl Split {
    /// The rest of a function that does something with the pool of an entry.
    fn each(&self, out: &mut String, entry: &str, with: impl Fn(usize) -> String) {
        let last = self.pools - 1;
        if last > 0 {
            let _ = writeln!(out, "    switch {entry} / {}u {{", self.voxels);
            for k in 0..last {
                let _ = writeln!(out, "        case {k}u: {{ {} }}", with(k));
            }
            let _ = writeln!(out, "        default: {{ {} }}\n    }}\n}}", with(last));
        } else {
            let _ = writeln!(out, "    {}\n}}", with(last));
        }
    }
}

/// `add_NAME(i, value)`: add to the i-th fixed-point number of an array that many write to.
pub(crate) fn add(name: &str) -> String {
    format!(
        "fn add_{name}(i: u32, value: f32) {{\n    if (value == 0.0) {{ return; }}\n    let v = to_fixed(value);\n    \
         let before = atomicAdd(&{name}[2u * i], v.low);\n    \
         let high = v.high + select(0u, 1u, before + v.low < before);\n    \
         if (high != 0u) {{ atomicAdd(&{name}[2u * i + 1u], high); }}\n}}\n"
    )
}

/// `take_NAME(i)`: the i-th fixed-point number of an array, which is 0 afterwards.
pub(crate) fn take(name: &str) -> String {
    format!(
        "fn take_{name}(i: u32) -> f32 {{\n    let v = Fixed({name}[2u * i], {name}[2u * i + 1u]);\n    \
         {name}[2u * i] = 0u;\n    {name}[2u * i + 1u] = 0u;\n    return from_fixed(v);\n}}\n"
    )
}

/// Workgroups for so many invocations.
pub(crate) fn workgroups(invocations: usize) -> u32 {
    invocations.div_ceil(WORKGROUP as usize) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pools_cover_all_voxels_and_none_is_larger_than_a_binding() {
        for (voxels, binding) in [(64, 1 << 27), (64 * 5000, 1 << 20), (64 * 4097, 9_000_001)] {
            let [learning, showing] = [Purpose::Learning, Purpose::Showing]
                .map(|purpose| Shape::within(purpose, ShDegree::default(), voxels, binding));
            for (split, bytes) in [
                (learning.colour, learning.colour_bytes()),
                (learning.gradient, learning.gradient_bytes()),
                (showing.colour, showing.colour_bytes()),
            ] {
                let ranges: Vec<_> = (0..split.pools).map(|k| split.range(k, voxels)).collect();
                assert!(ranges.iter().all(|r| !r.is_empty() && r.len() as u64 * bytes <= binding));
                assert_eq!(ranges.iter().map(|r| r.len()).sum::<usize>(), voxels);
                assert!(ranges.iter().all(|r| r.start % BRICK_VOXELS == 0));
            }
        }
    }
}
