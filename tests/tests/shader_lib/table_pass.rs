//! Runs a pass of the repository that works on tables alone: buffers by address, one job record, no images.

use std::sync::Arc;

use caustica_gpu::{
    Access, Buffer, BufferUse, ComputePipeline, Location, MemoryUse, Recorder, ShaderModule, Specialization,
    Stage, Use,
};
use caustica_renderer::gpu_types::Push;
use caustica_renderer::shader::{ShaderSources, SpirvCache, compile, reflect};
use caustica_tests::compute::bytes;
use caustica_tests::gpu::Session;
use caustica_tests::shaders_under_test;

/// What a pass reads and writes.
pub struct TablePass<'a> {
    /// The main file.
    pub file: &'a str,
    /// Groups of the dispatch.
    pub groups: u32,
    /// Buffers that are read.
    pub inputs: &'a [&'a [u8]],
    /// Buffers that are written, with what they hold before.
    pub outputs: &'a [&'a [u8]],
}

impl TablePass<'_> {
    /// Runs the pass once; `job` makes its record from the addresses of inputs and outputs, and may stage more. Returns
    /// the outputs.
    ///
    /// # Panics
    /// When the device cannot.
    pub fn run(
        &self,
        session: &mut Session,
        job: impl FnOnce(&mut Recorder, &[u64], &[u64]) -> Vec<u8>,
    ) -> Vec<Vec<u8>> {
        let device = Arc::clone(&session.device);
        let source = ShaderSources::new(shaders_under_test()).load(self.file).expect("the pass");
        let words = compile(&source, &SpirvCache::of_user()).expect("it compiles");
        let interface = reflect(self.file, &words).expect("its interface fits").interface;
        let module = ShaderModule::new(&device, self.file, &words).expect("a shader module");
        let general = Specialization::default();
        let pipeline = ComputePipeline::new(&device, self.file, &module, &interface, &general, None)
            .expect("a pipeline that needs no scene");
        let mut recorder = session.frames.begin().expect("a frame");
        let mut upload = |list: &[&[u8]]| -> Vec<Buffer> {
            let make = |data: &&[u8]| {
                let (size, usage, kind) = (data.len() as u64, BufferUse::General, MemoryUse::Tables);
                let buffer =
                    Buffer::new(&device, "table", size, usage, Location::Device, kind).expect("memory");
                recorder.upload(&buffer, 0, data).expect("an upload");
                buffer
            };
            list.iter().map(make).collect()
        };
        let (inputs, outputs) = (upload(self.inputs), upload(self.outputs));
        let addresses = |list: &[Buffer]| list.iter().map(Buffer::address).collect::<Vec<u64>>();
        let job = job(&mut recorder, &addresses(&inputs), &addresses(&outputs));
        let frame_address = recorder.stage_bytes(&job).expect("staging memory");
        let push = [Push { frame_address, argument0: 0, argument1: 0 }];
        let read = inputs.iter().map(|buffer| Use::Buffer(buffer, Stage::Compute, Access::StorageRead));
        let written =
            outputs.iter().map(|buffer| Use::Buffer(buffer, Stage::Compute, Access::StorageReadWrite));
        let uses: Vec<Use<'_>> = read.chain(written).collect();
        recorder
            .dispatch(&pipeline, None, &[], &uses, bytes(&push), [self.groups, 1, 1])
            .expect("the pass runs");
        let host = |buffer: &Buffer| {
            let (usage, kind) = (BufferUse::General, MemoryUse::Staging);
            Buffer::new(&device, "read-back", buffer.size(), usage, Location::ReadBack, kind).expect("memory")
        };
        let hosts: Vec<Buffer> = outputs.iter().map(host).collect();
        for (output, host) in outputs.iter().zip(&hosts) {
            recorder.copy_buffer(output, host, output.size()).expect("a copy");
        }
        session.frames.submit(recorder, None).expect("a submission");
        session.frames.finish().expect("the device finishes");
        let size = |i: usize| self.outputs[i].len();
        hosts.iter().enumerate().map(|(i, host)| host.mapped()[..size(i)].to_vec()).collect()
    }
}
