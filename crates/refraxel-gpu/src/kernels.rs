//! The kernels: which files of `shaders/` each consists of, and which arrays it binds.

use crate::constants::declarations;
use crate::memory::Buffers;
use crate::pools::{Shape, add, take};
use crate::{Gpu, GpuError};
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
    files: &'static [&'static str],
    bindings: &'static [(&'static str, Access)],
}

macro_rules! shaders {
    ($($name:literal),*) => { &[$(include_str!(concat!("shaders/", $name, ".wgsl"))),*] };
}

/// Render rays.
pub(crate) const RENDER: Source = Source {
    entry: "render",
    files: shaders![
        "scene",
        "rays",
        "density",
        "domain",
        "bricks",
        "trilinear",
        "sh",
        "colour",
        "background",
        "march",
        "render"
    ],
    bindings: &[
        ("scene", Uniform),
        ("task", Uniform),
        ("table", Read),
        ("forward", Read),
        ("occupied", Read),
        ("density", Read),
        ("colour", Read),
        ("texels", Read),
        ("lessons", Read),
        ("seen", Writes),
    ],
};

/// Compare rays with their targets and march back.
pub(crate) const LEARN: Source = Source {
    entry: "learn",
    files: shaders![
        "scene",
        "rays",
        "density",
        "domain",
        "bricks",
        "trilinear",
        "sh",
        "colour",
        "background",
        "march",
        "fixed",
        "touched",
        "priors",
        "ray_gradient",
        "learn"
    ],
    bindings: &[
        ("scene", Uniform),
        ("task", Uniform),
        ("table", Read),
        ("forward", Read),
        ("occupied", Read),
        ("density", Read),
        ("colour", Read),
        ("texels", Read),
        ("lessons", Read),
        ("seen", Read),
        ("ray_gradients", Writes),
        ("density_gradient", Atomic),
        ("colour_gradient", Atomic),
        ("texel_gradient", Atomic),
        ("touched", Atomic),
        ("status", Atomic),
    ],
};

/// Add the gradient of total variation.
pub(crate) const VARIATION: Source = Source {
    entry: "variation",
    files: shaders!["scene", "fixed", "touched", "priors", "variation"],
    bindings: &[
        ("scene", Uniform),
        ("task", Uniform),
        ("table", Read),
        ("brick_of_slot", Read),
        ("density", Read),
        ("colour", Read),
        ("density_gradient", Atomic),
        ("colour_gradient", Atomic),
        ("touched", Atomic),
    ],
};

/// Move the touched voxels.
pub(crate) const UPDATE: Source = Source {
    entry: "update",
    files: shaders!["scene", "fixed", "rms_prop", "update"],
    bindings: &[
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
    ],
};

/// Move the background.
pub(crate) const UPDATE_BACKGROUND: Source = Source {
    entry: "update_background",
    files: shaders!["scene", "fixed", "rms_prop", "update_background"],
    bindings: &[
        ("scene", Uniform),
        ("task", Uniform),
        ("texels", Writes),
        ("texel_moment", Writes),
        ("texel_gradient", Writes),
        ("status", Read),
    ],
};

/// Note the outcome of a step.
pub(crate) const CONCLUDE: Source = Source {
    entry: "conclude",
    files: shaders!["scene", "conclude"],
    bindings: &[("scene", Uniform), ("task", Uniform), ("status", Writes), ("outcomes", Writes)],
};

/// Find out which cells may hold matter.
pub(crate) const OCCUPANCY: Source = Source {
    entry: "occupancy",
    files: shaders!["scene", "bricks", "occupancy"],
    bindings: &[
        ("scene", Uniform),
        ("task", Uniform),
        ("forward", Read),
        ("density", Read),
        ("occupied", Writes),
    ],
};

/// Find out which voxels rays see.
pub(crate) const PEAK: Source = Source {
    entry: "peak",
    files: shaders!["scene", "rays", "density", "domain", "bricks", "trilinear", "march", "peak"],
    bindings: &[
        ("scene", Uniform),
        ("task", Uniform),
        ("table", Read),
        ("forward", Read),
        ("occupied", Read),
        ("density", Read),
        ("lessons", Read),
        ("weights", Atomic),
    ],
};

/// Type of the elements of an array.
fn element(name: &str) -> &'static str {
    match name {
        "table" => "i32",
        "forward" | "occupied" | "brick_of_slot" | "touched" | "status" | "outcomes" | "weights" => "u32",
        "lessons" => "Lesson",
        "seen" => "Seen",
        "ray_gradients" => "RayGradient",
        "colour" => "vec4<f32>",
        "density" | "texels" | "density_moment" | "colour_moment" | "texel_moment" => "f32",
        gradient => {
            debug_assert!(gradient.ends_with("_gradient"), "{gradient}");
            "u32"
        }
    }
}

impl Source {
    /// The names of its buffers, in the order of their bindings: pools one by one.
    fn names(&self, shape: &Shape) -> Vec<(String, &'static str, Access)> {
        let expand = |&(name, access): &(&'static str, Access)| {
            let pools = match name {
                "colour" => shape.colour.pools,
                "colour_gradient" => shape.gradient.pools,
                _ => return vec![(name.to_owned(), name, access)],
            };
            (0..pools).map(|k| (format!("{name}_{k}"), name, access)).collect()
        };
        self.bindings.iter().flat_map(expand).collect()
    }

    /// The whole text: constants, bindings, functions that read and write them, and the files.
    pub(crate) fn compose(&self, shape: &Shape) -> String {
        let mut out = declarations(shape);
        for (number, (name, kind, access)) in self.names(shape).into_iter().enumerate() {
            let (space, of) = match (access, kind) {
                (Uniform, "scene") => ("uniform", "Scene".to_owned()),
                (Uniform, _) => ("uniform", "Task".to_owned()),
                (Read, _) => ("storage, read", format!("array<{}>", element(kind))),
                (Writes, _) => ("storage, read_write", format!("array<{}>", element(kind))),
                (Atomic, _) => ("storage, read_write", format!("array<atomic<{}>>", element(kind))),
            };
            let _ = writeln!(out, "@group(0) @binding({number}) var<{space}> {name}: {of};");
        }
        for &(name, access) in self.bindings {
            match (name, access) {
                ("colour", access) => out += &shape.colour_access(access == Writes),
                ("colour_gradient", access) => out += &shape.gradient_access(access == Atomic),
                ("density_gradient" | "texel_gradient", Atomic) => out += &add(name),
                ("density_gradient" | "texel_gradient", _) => out += &take(name),
                ("status", Atomic) => out += &add(name),
                _ => {}
            }
        }
        self.files.iter().for_each(|file| out += file);
        out
    }
}

/// A compiled kernel.
#[derive(Debug)]
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    buffers: Vec<String>,
}

impl Kernel {
    pub(crate) fn new(gpu: &Gpu, source: &Source, shape: &Shape) -> Self {
        let (device, label) = (&gpu.device, Some(source.entry));
        let text = source.compose(shape);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label,
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        let names = source.names(shape);
        let entry =
            |(binding, (_, _, access)): (usize, &(String, &str, Access))| wgpu::BindGroupLayoutEntry {
                binding: binding as u32,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match access {
                        Uniform => wgpu::BufferBindingType::Uniform,
                        access => wgpu::BufferBindingType::Storage { read_only: *access == Read },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            };
        let entries: Vec<_> = names.iter().enumerate().map(entry).collect();
        let layout =
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: label,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self { pipeline, layout, buffers: names.into_iter().map(|(name, _, _)| name).collect() }
    }

    /// Run so many workgroups on the buffers of these names, found in the first that has one.
    ///
    /// # Panics
    /// If none of them has a buffer that the kernel needs.
    pub(crate) fn run(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        of: &[&Buffers],
        workgroups: u32,
    ) {
        if workgroups == 0 {
            return;
        }
        let buffer = |name: &String| {
            let found = of.iter().find_map(|buffers| buffers.get(name));
            found.unwrap_or_else(|| panic!("no buffer is called {name}"))
        };
        let entry = |(k, name)| wgpu::BindGroupEntry {
            binding: k as u32,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: buffer(name),
                offset: 0,
                size: None,
            }),
        };
        let entries: Vec<_> = self.buffers.iter().enumerate().map(entry).collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        });
        let most = gpu.device.limits().max_compute_workgroups_per_dimension;
        let columns = workgroups.min(most);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(columns, workgroups.div_ceil(columns), 1);
    }
}

/// All kernels of a shape.
#[derive(Debug)]
pub(crate) struct Kernels {
    pub shape: Shape,
    pub render: Kernel,
    pub learn: Kernel,
    pub variation: Kernel,
    pub update: Kernel,
    pub update_background: Kernel,
    pub conclude: Kernel,
    pub occupancy: Kernel,
    pub peak: Kernel,
}

impl Kernels {
    pub(crate) fn new(gpu: &Gpu, shape: Shape) -> Result<Self, GpuError> {
        let kernel = |source| Kernel::new(gpu, source, &shape);
        let kernels = Self {
            shape,
            render: kernel(&RENDER),
            learn: kernel(&LEARN),
            variation: kernel(&VARIATION),
            update: kernel(&UPDATE),
            update_background: kernel(&UPDATE_BACKGROUND),
            conclude: kernel(&CONCLUDE),
            occupancy: kernel(&OCCUPANCY),
            peak: kernel(&PEAK),
        };
        gpu.fault().map_or(Ok(kernels), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    use refraxel_core::ShDegree;

    #[test]
    fn all_kernels_are_valid_at_every_degree_and_with_many_pools() {
        let sources =
            [&RENDER, &LEARN, &VARIATION, &UPDATE, &UPDATE_BACKGROUND, &CONCLUDE, &OCCUPANCY, &PEAK];
        for degree in (0..=3).filter_map(ShDegree::new) {
            for binding in [1 << 27, 1 << 16] {
                let shape = Shape::within(degree, 1000, binding);
                for source in sources {
                    let text = source.compose(&shape);
                    let module = naga::front::wgsl::parse_str(&text)
                        .unwrap_or_else(|e| panic!("{}: {}", source.entry, e.emit_to_string(&text)));
                    let found =
                        Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
                    if let Err(e) = found {
                        panic!("{}: {}", source.entry, e.emit_to_string(&text));
                    }
                    assert!(module.entry_points.iter().any(|e| e.name == source.entry));
                }
            }
        }
    }
}
