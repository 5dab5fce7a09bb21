//! Arrays that are larger than a binding: cut into pools of whole bricks, read and written by generated functions.

use crate::shape::{Purpose, Shape, Split};
use std::fmt::Write;

impl Shape {
    /// Type of four coefficients of colour in an array.
    pub(crate) fn colour_element(&self) -> &'static str {
        match self.purpose {
            Purpose::Learning => "vec4<f32>",
            Purpose::Showing => "vec2<u32>",
        }
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
