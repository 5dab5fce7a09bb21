//! The sources of kernels: which files of `shaders/` each consists of, and which arrays it binds.

use crate::bodies::MAX_REGIONS;
use crate::constants::declarations;
use crate::pools::{add, take};
use crate::shape::Shape;
use std::fmt::Write;

/// How a kernel uses an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Uniform,
    Read,
    Write,
    Atomic,
}
use Access::{Atomic, Read, Uniform, Write as Writes};

/// A kernel before it is compiled.
pub(crate) struct Source {
    /// Its entry point.
    pub entry: &'static str,
    /// In groups, of which kernels share some.
    files: &'static [&'static [&'static str]],
    bindings: &'static [&'static [(&'static str, Access)]],
}

macro_rules! shaders {
    ($($name:literal),*) => { &[$(include_str!(concat!("shaders/", $name, ".wgsl"))),*] };
}

/// Marches rays.
const MARCH: &[&str] = shaders!["scene", "rays", "density", "domain", "bricks", "trilinear", "march"];
/// What that reads.
const MARCHED: &[(&str, Access)] = &[
    ("scene", Uniform),
    ("task", Uniform),
    ("table", Read),
    ("forward", Read),
    ("occupied", Read),
    ("density", Read),
    ("lessons", Read),
];
/// Shades what they meet.
const SHADE: &[&str] = shaders!["sh", "colour", "background"];
/// What that reads.
const SHADED: &[(&str, Access)] = &[("colour", Read), ("texels", Read)];

/// Follows rays that bend.
const TRACE: &[&str] = shaders!["bending", "lattice", "stencil", "medium", "crossing", "event", "trace"];
/// What that reads.
const TRACED: &[(&str, Access)] = &[
    ("bending", Uniform),
    ("regions", Uniform),
    ("lattices", Uniform),
    ("coefficients", Read),
    ("clearance", Read),
];
/// Takes the paths of rays further.
const FOLLOW: &[&str] = shaders!["fixed", "checkpoint", "path", "path_state"];
/// What that reads and writes.
const FOLLOWED: &[(&str, Access)] = &[("checkpoints", Writes), ("status", Atomic)];
/// What surfaces mirror, and the caches that they read.
const MIRROR: &[&str] =
    shaders!["scene", "rays", "bending", "checkpoint", "light", "reflections", "sh", "trilinear", "probes"];
/// What those are.
const CACHES: &[(&str, Access)] = &[("caches", Uniform), ("probes", Read)];
/// What rays are compared with, and what receives gradients from them.
const LEARNED: &[(&str, Access)] = &[
    ("seen", Read),
    ("ray_gradients", Writes),
    ("density_gradient", Atomic),
    ("colour_gradient", Atomic),
    ("texel_gradient", Atomic),
    ("touched", Atomic),
    ("status", Atomic),
];

/// Render rays.
pub(crate) const RENDER: Source = Source {
    entry: "render",
    files: &[MARCH, SHADE, shaders!["render"]],
    bindings: &[MARCHED, SHADED, &[("seen", Writes)]],
};

/// Render rays that may bend.
pub(crate) const RENDER_BENT: Source = Source {
    entry: "render_bent",
    files: &[MARCH, SHADE, TRACE, FOLLOW, shaders!["light", "absorption", "reflections", "render_bent"]],
    bindings: &[MARCHED, SHADED, TRACED, FOLLOWED, &[("seen", Writes), ("reflections", Writes)]],
};

/// Find out where the paths of rays are mirrored.
pub(crate) const FIND_REFLECTIONS: Source = Source {
    entry: "find_reflections",
    files: &[MARCH, TRACE, FOLLOW, shaders!["reflections", "fresnel", "find_reflections"]],
    bindings: &[MARCHED, TRACED, FOLLOWED, &[("reflections", Writes), ("passings", Writes)]],
};

/// Mix what paths show with what surfaces mirror.
pub(crate) const MIRROR_LIGHT: Source = Source {
    entry: "mirror",
    files: &[MIRROR, shaders!["fixed", "mirror"]],
    bindings: &[
        &[
            ("scene", Uniform),
            ("task", Uniform),
            ("bending", Uniform),
            ("checkpoints", Read),
            ("reflections", Writes),
            ("lessons", Read),
            ("seen", Writes),
            ("status", Atomic),
        ],
        CACHES,
    ],
};

/// The adjoint of what surfaces mirror.
pub(crate) const MIRROR_VJP: Source = Source {
    entry: "mirror_vjp",
    files: &[
        MIRROR,
        shaders![
            "fixed",
            "domain",
            "lattice",
            "stencil",
            "medium",
            "stencil_vjp",
            "index_sample",
            "fresnel",
            "probes_vjp",
            "compare",
            "mirror_vjp"
        ],
    ],
    bindings: &[
        &[
            ("scene", Uniform),
            ("task", Uniform),
            ("checkpoints", Read),
            ("reflections", Writes),
            ("lessons", Read),
            ("seen", Read),
            ("status", Atomic),
            ("index_gradient", Atomic),
            ("probe_gradient", Atomic),
        ],
        TRACED,
        CACHES,
    ],
};

/// Compare rays that may bend with their targets and march back along their paths.
pub(crate) const LEARN_BENT: Source = Source {
    entry: "learn_bent",
    files: &[
        MARCH,
        SHADE,
        TRACE,
        shaders![
            "light",
            "absorption",
            "reflections",
            "checkpoint",
            "path",
            "fixed",
            "touched",
            "priors",
            "ray_gradient_fields",
            "ray_gradient",
            "near_share",
            "scatter",
            "stencil_vjp",
            "index_sample",
            "trace_vjp",
            "compare",
            "learn_bent"
        ],
    ],
    bindings: &[
        MARCHED,
        SHADED,
        TRACED,
        LEARNED,
        &[
            ("checkpoints", Read),
            ("reflections", Read),
            ("ways", Writes),
            ("steps", Writes),
            ("index_gradient", Atomic),
        ],
    ],
};

/// Compare rays with their targets and march back.
pub(crate) const LEARN: Source = Source {
    entry: "learn",
    files: &[
        MARCH,
        SHADE,
        shaders![
            "fixed",
            "touched",
            "priors",
            "ray_gradient_fields",
            "ray_gradient",
            "near_share",
            "scatter",
            "fresnel",
            "bending",
            "coats",
            "learn"
        ],
    ],
    bindings: &[MARCHED, SHADED, LEARNED, &[("bending", Uniform), ("coats", Read)]],
};

/// The clearcoat of what straight rays meet.
const COATS: &[&str] = shaders!["density_slope", "bending", "fresnel", "coats"];

/// Find the surfaces at which straight rays end.
pub(crate) const FACE: Source = Source {
    entry: "face",
    files: &[MARCH, COATS, shaders!["face"]],
    bindings: &[MARCHED, &[("bending", Uniform), ("coats", Writes)]],
};

/// Mix what straight rays show with what a clearcoat mirrors.
pub(crate) const COAT: Source = Source {
    entry: "coat",
    files: &[shaders![
        "scene",
        "rays",
        "bending",
        "light",
        "sh",
        "trilinear",
        "probes",
        "fresnel",
        "coats",
        "coat"
    ]],
    bindings: &[
        &[("scene", Uniform), ("task", Uniform), ("bending", Uniform), ("coats", Writes), ("seen", Writes)],
        CACHES,
    ],
};

/// The adjoint of what a clearcoat mirrors.
pub(crate) const COAT_VJP: Source = Source {
    entry: "coat_vjp",
    files: &[shaders![
        "scene",
        "rays",
        "bending",
        "fixed",
        "light",
        "sh",
        "trilinear",
        "probes",
        "fresnel",
        "probes_vjp",
        "coats",
        "coat_vjp"
    ]],
    bindings: &[
        &[
            ("scene", Uniform),
            ("task", Uniform),
            ("bending", Uniform),
            ("coats", Writes),
            ("seen", Read),
            ("lessons", Read),
            ("probe_gradient", Atomic),
        ],
        CACHES,
    ],
};

/// March back from the surfaces at which straight rays end.
pub(crate) const LEARN_COAT: Source = Source {
    entry: "learn_coat",
    files: &[
        MARCH,
        COATS,
        shaders!["fixed", "touched", "near_share", "ray_gradient_fields", "density_slope_vjp", "learn_coat"],
    ],
    bindings: &[
        MARCHED,
        &[
            ("bending", Uniform),
            ("coats", Read),
            ("ray_gradients", Writes),
            ("density_gradient", Atomic),
            ("touched", Atomic),
        ],
    ],
};

/// Add the gradient of total variation.
pub(crate) const VARIATION: Source = Source {
    entry: "variation",
    files: &[shaders!["scene", "fixed", "touched", "priors", "variation"]],
    bindings: &[&[
        ("scene", Uniform),
        ("task", Uniform),
        ("table", Read),
        ("brick_of_slot", Read),
        ("density", Read),
        ("colour", Read),
        ("density_gradient", Atomic),
        ("colour_gradient", Atomic),
        ("touched", Atomic),
    ]],
};

/// Move the touched voxels.
pub(crate) const UPDATE: Source = Source {
    entry: "update",
    files: &[shaders!["scene", "fixed", "rms_prop", "update"]],
    bindings: &[&[
        ("scene", Uniform),
        ("task", Uniform),
        ("density", Writes),
        ("density_moment", Writes),
        ("density_gradient", Writes),
        ("colour", Writes),
        ("colour_moment", Writes),
        ("colour_gradient", Writes),
        ("touched", Read),
        ("status", Atomic),
    ]],
};

/// Move the background.
pub(crate) const UPDATE_BACKGROUND: Source = Source {
    entry: "update_background",
    files: &[shaders!["scene", "fixed", "rms_prop", "update_background"]],
    bindings: &[&[
        ("scene", Uniform),
        ("task", Uniform),
        ("texels", Writes),
        ("texel_moment", Writes),
        ("texel_gradient", Writes),
        ("status", Read),
    ]],
};

/// Note the outcome of a step.
pub(crate) const CONCLUDE: Source = Source {
    entry: "conclude",
    files: &[shaders!["scene", "conclude"]],
    bindings: &[&[("scene", Uniform), ("task", Uniform), ("status", Writes), ("outcomes", Writes)]],
};

/// Find out which cells may hold matter.
pub(crate) const OCCUPANCY: Source = Source {
    entry: "occupancy",
    files: &[shaders!["scene", "bricks", "occupancy"]],
    bindings: &[&[
        ("scene", Uniform),
        ("task", Uniform),
        ("forward", Read),
        ("density", Read),
        ("occupied", Writes),
    ]],
};

/// Copy an array.
pub(crate) const COPY: Source = Source {
    entry: "copy",
    files: &[shaders!["scene", "copy"]],
    bindings: &[&[("original", Read), ("duplicate", Writes)]],
};

/// What sums up how much of each voxel rays see.
const WEIGHTS: &[(&str, Access)] = &[("weights", Atomic)];

/// Find out which voxels rays see.
pub(crate) const PEAK: Source =
    Source { entry: "peak", files: &[MARCH, shaders!["weigh", "peak"]], bindings: &[MARCHED, WEIGHTS] };

/// The same where rays may bend.
pub(crate) const PEAK_BENT: Source = Source {
    entry: "peak_bent",
    files: &[MARCH, TRACE, FOLLOW, shaders!["weigh", "peak_bent"]],
    bindings: &[MARCHED, WEIGHTS, TRACED, FOLLOWED],
};

/// Draw a batch from photographs.
pub(crate) const DRAW: Source = Source {
    entry: "draw",
    files: &[shaders![
        "scene",
        "rays",
        "fixed",
        "light",
        "domain",
        "trilinear",
        "wide",
        "random",
        "photograph",
        "gate",
        "draw"
    ]],
    bindings: &[&[
        ("scene", Uniform),
        ("task", Uniform),
        ("selection", Uniform),
        ("views", Read),
        ("marks", Read),
        ("photographs", Read),
        ("gates", Read),
        ("gate_bytes", Read),
        ("lessons", Writes),
        ("status", Atomic),
    ]],
};

/// Type of the elements of an array.
fn element(name: &str, shape: &Shape) -> &'static str {
    match name {
        "table" => "i32",
        "forward" | "occupied" | "brick_of_slot" | "touched" | "status" | "outcomes" | "weights"
        | "clearance" | "marks" | "photographs" | "gate_bytes" => "u32",
        "views" => "View",
        "gates" => "Gate",
        "lessons" => "Lesson",
        "seen" => "Seen",
        "ray_gradients" => "RayGradient",
        "checkpoints" => "Checkpoint",
        "steps" => "Step",
        "coats" => "Coat",
        "reflections" => "Reflection",
        "passings" => "Passing",
        "ways" => "WayBack",
        "colour" => shape.colour_element(),
        "original" | "duplicate" => "vec4<f32>",
        "density" | "texels" | "coefficients" | "probes" | "density_moment" | "colour_moment"
        | "texel_moment" => "f32",
        gradient => {
            debug_assert!(gradient.ends_with("_gradient"), "{gradient}");
            "u32"
        }
    }
}

impl Source {
    /// The names of its buffers, in the order of their bindings: pools one by one.
    pub(crate) fn names(&self, shape: &Shape) -> Vec<(String, &'static str, Access)> {
        let expand = |&(name, access): &(&'static str, Access)| {
            let pools = match name {
                "colour" => shape.colour.pools,
                "colour_gradient" => shape.gradient.pools,
                "photographs" => shape.photographs.pools,
                _ => return vec![(name.to_owned(), name, access)],
            };
            (0..pools).map(|k| (format!("{name}_{k}"), name, access)).collect()
        };
        self.bindings.iter().copied().flatten().flat_map(expand).collect()
    }

    /// The whole text: constants, bindings, functions that read and write them, and the files.
    pub(crate) fn compose(&self, shape: &Shape) -> String {
        let mut out = declarations(shape);
        for (number, (name, kind, access)) in self.names(shape).into_iter().enumerate() {
            let (space, of) = match (access, kind) {
                (Uniform, "scene") => ("uniform", "Scene".to_owned()),
                (Uniform, "selection") => ("uniform", "Selection".to_owned()),
                (Uniform, "bending") => ("uniform", "Bending".to_owned()),
                (Uniform, "regions") => ("uniform", format!("array<Region, {MAX_REGIONS}>")),
                (Uniform, "lattices") => ("uniform", format!("array<Lattice, {}>", 2 * MAX_REGIONS)),
                (Uniform, "caches") => ("uniform", format!("array<Cache, {}>", 2 * MAX_REGIONS + 2)),
                (Uniform, _) => ("uniform", "Task".to_owned()),
                (Read, _) => ("storage, read", format!("array<{}>", element(kind, shape))),
                (Writes, _) => ("storage, read_write", format!("array<{}>", element(kind, shape))),
                (Atomic, _) => ("storage, read_write", format!("array<atomic<{}>>", element(kind, shape))),
            };
            let _ = writeln!(out, "@group(0) @binding({number}) var<{space}> {name}: {of};");
        }
        for &(name, access) in self.bindings.iter().copied().flatten() {
            match (name, access) {
                ("colour", access) => out += &shape.colour_access(access == Writes),
                ("photographs", _) => out += &shape.photograph_access(),
                ("colour_gradient", access) => out += &shape.gradient_access(access == Atomic),
                ("density_gradient" | "texel_gradient" | "index_gradient" | "probe_gradient", Atomic) => {
                    out += &add(name);
                }
                ("density_gradient" | "texel_gradient", _) => out += &take(name),
                ("status", Atomic) => out += &add(name),
                _ => {}
            }
        }
        self.files.iter().copied().flatten().for_each(|file| out += file);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Purpose, Split};
    use naga::back::spv;
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    use refraxel_core::ShDegree;

    #[test]
    fn all_kernels_are_valid_at_every_degree_and_with_many_pools() {
        let sources = [
            &RENDER,
            &RENDER_BENT,
            &FIND_REFLECTIONS,
            &MIRROR_LIGHT,
            &MIRROR_VJP,
            &FACE,
            &COAT,
            &COAT_VJP,
            &LEARN_COAT,
            &LEARN,
            &LEARN_BENT,
            &PEAK_BENT,
            &VARIATION,
            &UPDATE,
            &UPDATE_BACKGROUND,
            &CONCLUDE,
            &OCCUPANCY,
            &PEAK,
            &DRAW,
            &COPY,
        ];
        let purposes = [Purpose::Learning, Purpose::Showing];
        for (degree, purpose) in
            (0..=3).filter_map(ShDegree::new).flat_map(|degree| purposes.map(|purpose| (degree, purpose)))
        {
            for binding in [1 << 27, 1 << 16] {
                let photographs = Split::new(100_000, 4, binding);
                let shape = Shape { photographs, ..Shape::within(purpose, degree, 1000, binding) };
                for source in sources {
                    let text = source.compose(&shape);
                    let module = naga::front::wgsl::parse_str(&text)
                        .unwrap_or_else(|e| panic!("{}: {}", source.entry, e.emit_to_string(&text)));
                    // Halves are unpacked wherever there is Vulkan, Metal or DirectX 12.
                    let needed = match purpose {
                        Purpose::Learning => Capabilities::empty(),
                        Purpose::Showing => Capabilities::SHADER_FLOAT16_IN_FLOAT32,
                    };
                    let found = Validator::new(ValidationFlags::all(), needed).validate(&module);
                    let info =
                        found.unwrap_or_else(|e| panic!("{}: {}", source.entry, e.emit_to_string(&text)));
                    // What is valid and cannot be written, such as a pointer to a member, ends in a panic.
                    spv::write_vec(&module, &info, &spv::Options::default(), None).expect(source.entry);
                    assert!(module.entry_points.iter().any(|e| e.name == source.entry));
                }
            }
        }
    }
}
