//! Compiled kernels.

use crate::constants::WORKGROUP;
use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use crate::shape::Shape;
use crate::sources::{
    Access, COAT, COAT_VJP, CONCLUDE, FACE, FIND_REFLECTIONS, LEARN, LEARN_BENT, LEARN_COAT, MIRROR_LIGHT,
    MIRROR_VJP, OCCUPANCY, PEAK, PEAK_BENT, RENDER, RENDER_BENT, Source, UPDATE, UPDATE_BACKGROUND,
    VARIATION,
};
use refraxel_core::ShDegree;
use std::sync::OnceLock;

/// A compiled kernel.
#[derive(Debug)]
pub(crate) struct Kernel {
    entry: &'static str,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    buffers: Vec<String>,
}

impl Kernel {
    pub(crate) fn new(device: &Device, source: &Source, shape: &Shape) -> Self {
        let (handle, label) = (&device.handle, Some(source.entry));
        let text = source.compose(shape);
        let module = handle.create_shader_module(wgpu::ShaderModuleDescriptor {
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
                        Access::Uniform => wgpu::BufferBindingType::Uniform,
                        access => wgpu::BufferBindingType::Storage { read_only: *access == Access::Read },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            };
        let entries: Vec<_> = names.iter().enumerate().map(entry).collect();
        let layout =
            handle.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
        let pipeline = handle.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&handle.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: label,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let buffers = names.into_iter().map(|(name, _, _)| name).collect();
        Self { entry: source.entry, pipeline, layout, buffers }
    }

    /// Run so many invocations on the buffers of these names, found in the first that has one.
    ///
    /// # Panics
    /// If none of them has a buffer that the kernel needs.
    pub(crate) fn run(
        &self,
        device: &Device,
        encoder: &mut wgpu::CommandEncoder,
        of: &[&Buffers],
        invocations: usize,
    ) {
        self.run_often(device, encoder, of, invocations, 1);
    }

    /// The same so many times, one after the other.
    pub(crate) fn run_often(
        &self,
        device: &Device,
        encoder: &mut wgpu::CommandEncoder,
        of: &[&Buffers],
        invocations: usize,
        times: usize,
    ) {
        if invocations == 0 {
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
        let group = device.handle.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        });
        let workgroups = invocations.div_ceil(WORKGROUP as usize) as u32;
        let columns = workgroups.min(device.workgroup_limit);
        let places = device.times(self.entry);
        let timestamp_writes = places.as_ref().map(|(query_set, first)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(*first),
            end_of_pass_write_index: Some(first + 1),
        });
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: None, timestamp_writes });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        for _ in 0..times {
            pass.dispatch_workgroups(columns, workgroups.div_ceil(columns), 1);
        }
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
    bent: OnceLock<BentKernels>,
    mirrors: OnceLock<MirrorKernels>,
    coat: OnceLock<CoatKernels>,
}

/// What takes the place of the kernels of the same names where rays bend.
#[derive(Debug)]
pub(crate) struct BentKernels {
    pub render: Kernel,
    pub learn: Kernel,
    pub peak: Kernel,
}

/// What runs beside those where surfaces mirror.
#[derive(Debug)]
pub(crate) struct MirrorKernels {
    pub find: Kernel,
    pub mirror: Kernel,
    pub vjp: Kernel,
}

/// What runs beside those for straight rays where opaque things have a clearcoat.
#[derive(Debug)]
pub(crate) struct CoatKernels {
    pub face: Kernel,
    pub coat: Kernel,
    pub vjp: Kernel,
    pub learn: Kernel,
}

impl Kernels {
    pub(crate) fn new(device: &Device, shape: Shape) -> Result<Self, GpuError> {
        let kernel = |source| Kernel::new(device, source, &shape);
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
            bent: OnceLock::new(),
            mirrors: OnceLock::new(),
            coat: OnceLock::new(),
        };
        device.fault().map_or(Ok(kernels), Err)
    }

    /// Those for rays that bend, which are compiled when they are first needed.
    pub(crate) fn bent(&self, device: &Device) -> Result<&BentKernels, GpuError> {
        let kernel = |source| Kernel::new(device, source, &self.shape);
        let kernels = self.bent.get_or_init(|| BentKernels {
            render: kernel(&RENDER_BENT),
            learn: kernel(&LEARN_BENT),
            peak: kernel(&PEAK_BENT),
        });
        device.fault().map_or(Ok(kernels), Err)
    }

    /// Those for surfaces that mirror, which are compiled when they are first needed.
    pub(crate) fn mirrors(&self, device: &Device) -> Result<&MirrorKernels, GpuError> {
        // Caches have a degree of their own.
        let shape = Shape { degree: ShDegree::MAX, ..self.shape };
        let kernel = |source| Kernel::new(device, source, &shape);
        let kernels = self.mirrors.get_or_init(|| MirrorKernels {
            find: kernel(&FIND_REFLECTIONS),
            mirror: kernel(&MIRROR_LIGHT),
            vjp: kernel(&MIRROR_VJP),
        });
        device.fault().map_or(Ok(kernels), Err)
    }

    /// Those for clearcoats, which are compiled when they are first needed.
    pub(crate) fn coat(&self, device: &Device) -> Result<&CoatKernels, GpuError> {
        let shape = Shape { degree: ShDegree::MAX, ..self.shape };
        let kernel = |source| Kernel::new(device, source, &shape);
        let kernels = self.coat.get_or_init(|| CoatKernels {
            face: kernel(&FACE),
            coat: kernel(&COAT),
            vjp: kernel(&COAT_VJP),
            learn: kernel(&LEARN_COAT),
        });
        device.fault().map_or(Ok(kernels), Err)
    }
}
