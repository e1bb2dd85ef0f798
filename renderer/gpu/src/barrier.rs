//! Barriers are derived, not written: each pass declares its uses, the tracker answers with the barriers that must
//! stand before it. Pure bookkeeping: no Vulkan call is made here, so it is tested without a device.

use std::collections::HashMap;

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

/// Names a resource, or a group of resources that is always used as a whole (such as all BLASes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ResourceId(pub u64);

/// The part of the pipeline that makes an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Compute shaders.
    Compute,
    /// Ray-tracing shaders.
    RayTracing,
    /// Vertex and fragment shaders.
    Raster,
    /// Shaders of every kind, for what is written once and read everywhere.
    AnyShader,
    /// Copies, clears, blits.
    Transfer,
    /// Acceleration structure builds and copies.
    AccelBuild,
    /// Reads by the host after the submission has finished.
    Host,
}

/// What is done with a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Sampled or fetched image.
    Sampled,
    /// Storage image or buffer, read.
    StorageRead,
    /// Storage image or buffer, written.
    StorageWrite,
    /// Storage image or buffer, both.
    StorageReadWrite,
    /// Colour attachment, written (and blended).
    ColorAttachment,
    /// Depth attachment, tested and written.
    DepthAttachment,
    /// Source of a copy.
    TransferRead,
    /// Target of a copy.
    TransferWrite,
    /// Index buffer.
    IndexRead,
    /// Input of an acceleration structure build (vertices, instances) read by address.
    BuildInput,
    /// An acceleration structure that a build reads (a BLAS in a TLAS build).
    AccelRead,
    /// An acceleration structure or scratch that a build writes.
    AccelWrite,
    /// An acceleration structure that rays traverse.
    AccelTrace,
    /// Read by the host.
    HostRead,
}

/// What must be waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// Which resource.
    pub resource: ResourceId,
    /// Stages that must have finished.
    pub source_stages: S,
    /// Writes to be made available.
    pub source_access: A,
    /// Stages that wait.
    pub target_stages: S,
    /// Accesses to which the writes become visible.
    pub target_access: A,
    /// Old and new layout when the resource is an image and the layout changes.
    pub layouts: Option<(ImageLayout, ImageLayout)>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct State {
    layout: ImageLayout,
    write_stages: S,
    write_access: A,
    read_stages: S,
    /// Pairs of stages and accesses that already see the last write.
    visible: Vec<(S, A)>,
}

/// Follows the state of every resource on the queue's time line.
#[derive(Debug, Default)]
pub struct Tracker {
    states: HashMap<ResourceId, State>,
    undo: Vec<(ResourceId, Option<State>)>,
}

impl Tracker {
    /// Declares one use and returns the barrier that must stand before it, if any. `image` says whether layouts count.
    pub fn access(
        &mut self,
        resource: ResourceId,
        image: bool,
        stage: Stage,
        access: Access,
    ) -> Option<Barrier> {
        let old = self.states.get(&resource).cloned();
        let mut state = old.clone().unwrap_or_default();
        self.undo.push((resource, old));
        let (stages, access_flags) = scope(stage, access);
        let layout = if image { layout_of(access) } else { ImageLayout::UNDEFINED };
        let transition = image && state.layout != layout;
        let barrier = if is_write(access) || transition {
            let pending = state.write_stages | state.read_stages;
            let barrier = (transition || !pending.is_empty()).then_some(Barrier {
                resource,
                source_stages: if pending.is_empty() { S::TOP_OF_PIPE } else { pending },
                source_access: state.write_access,
                target_stages: stages,
                target_access: access_flags,
                layouts: transition.then_some((state.layout, layout)),
            });
            // A transition is a write that its own target already sees.
            let writes = is_write(access);
            state = State {
                layout,
                write_stages: stages,
                write_access: if writes { access_flags } else { A::NONE },
                read_stages: if writes { S::NONE } else { stages },
                visible: if writes { Vec::new() } else { vec![(stages, access_flags)] },
            };
            barrier
        } else {
            let seen = state.visible.iter().any(|(s, a)| s.contains(stages) && a.contains(access_flags));
            let barrier = (!state.write_stages.is_empty() && !seen).then_some(Barrier {
                resource,
                source_stages: state.write_stages,
                source_access: state.write_access,
                target_stages: stages,
                target_access: access_flags,
                layouts: None,
            });
            state.read_stages |= stages;
            if barrier.is_some() {
                state.visible.push((stages, access_flags));
            }
            barrier
        };
        self.states.insert(resource, state);
        barrier
    }

    /// Forgets a destroyed resource.
    pub fn forget(&mut self, resource: ResourceId) {
        self.states.remove(&resource);
    }

    /// What was declared since the last commit will run.
    pub fn commit(&mut self) {
        self.undo.clear();
    }

    /// What was declared since the last commit will not run: the states go back.
    pub fn roll_back(&mut self) {
        while let Some((resource, state)) = self.undo.pop() {
            match state {
                Some(state) => self.states.insert(resource, state),
                None => self.states.remove(&resource),
            };
        }
    }
}

fn is_write(access: Access) -> bool {
    matches!(
        access,
        Access::StorageWrite
            | Access::StorageReadWrite
            | Access::ColorAttachment
            | Access::DepthAttachment
            | Access::TransferWrite
            | Access::AccelWrite
    )
}

/// The image layout in which an access happens.
pub(crate) fn layout_of(access: Access) -> ImageLayout {
    match access {
        Access::Sampled => ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        Access::ColorAttachment => ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        Access::DepthAttachment => ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
        Access::TransferRead => ImageLayout::TRANSFER_SRC_OPTIMAL,
        Access::TransferWrite => ImageLayout::TRANSFER_DST_OPTIMAL,
        _ => ImageLayout::GENERAL,
    }
}

/// Stages and access flags of a use (Vulkan 1.3, table "Supported access types").
fn scope(stage: Stage, access: Access) -> (S, A) {
    let shader = match stage {
        Stage::Compute => S::COMPUTE_SHADER,
        Stage::RayTracing => S::RAY_TRACING_SHADER_KHR,
        Stage::Raster => S::VERTEX_SHADER | S::FRAGMENT_SHADER,
        Stage::AnyShader => {
            S::VERTEX_SHADER | S::FRAGMENT_SHADER | S::COMPUTE_SHADER | S::RAY_TRACING_SHADER_KHR
        }
        Stage::Transfer => S::ALL_TRANSFER,
        Stage::AccelBuild => S::ACCELERATION_STRUCTURE_BUILD_KHR,
        Stage::Host => S::HOST,
    };
    match access {
        Access::Sampled => (shader, A::SHADER_SAMPLED_READ),
        Access::StorageRead => (shader, A::SHADER_STORAGE_READ),
        Access::StorageWrite => (shader, A::SHADER_STORAGE_WRITE),
        Access::StorageReadWrite => (shader, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE),
        Access::ColorAttachment => {
            (S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE)
        }
        Access::DepthAttachment => (
            S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS,
            A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE,
        ),
        Access::TransferRead => (S::ALL_TRANSFER, A::TRANSFER_READ),
        Access::TransferWrite => (S::ALL_TRANSFER, A::TRANSFER_WRITE),
        Access::IndexRead => (S::INDEX_INPUT, A::INDEX_READ),
        Access::BuildInput => (S::ACCELERATION_STRUCTURE_BUILD_KHR, A::SHADER_READ),
        Access::AccelRead => (S::ACCELERATION_STRUCTURE_BUILD_KHR, A::ACCELERATION_STRUCTURE_READ_KHR),
        Access::AccelWrite => (
            S::ACCELERATION_STRUCTURE_BUILD_KHR,
            A::ACCELERATION_STRUCTURE_READ_KHR | A::ACCELERATION_STRUCTURE_WRITE_KHR,
        ),
        Access::AccelTrace => (S::RAY_TRACING_SHADER_KHR, A::ACCELERATION_STRUCTURE_READ_KHR),
        Access::HostRead => (S::HOST, A::HOST_READ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: ResourceId = ResourceId(7);

    #[test]
    fn read_after_write_waits_for_the_write() {
        let mut tracker = Tracker::default();
        assert_eq!(tracker.access(R, false, Stage::Compute, Access::StorageWrite), None);
        let barrier = tracker.access(R, false, Stage::RayTracing, Access::StorageRead);
        assert_eq!(
            barrier,
            Some(Barrier {
                resource: R,
                source_stages: S::COMPUTE_SHADER,
                source_access: A::SHADER_STORAGE_WRITE,
                target_stages: S::RAY_TRACING_SHADER_KHR,
                target_access: A::SHADER_STORAGE_READ,
                layouts: None,
            })
        );
    }

    #[test]
    fn a_second_reader_of_the_same_kind_needs_no_barrier_but_another_stage_does() {
        let mut tracker = Tracker::default();
        tracker.access(R, false, Stage::Transfer, Access::TransferWrite);
        assert!(tracker.access(R, false, Stage::Compute, Access::StorageRead).is_some());
        assert!(tracker.access(R, false, Stage::Compute, Access::StorageRead).is_none());
        let other = tracker.access(R, false, Stage::AccelBuild, Access::BuildInput);
        assert_eq!(other.map(|b| b.source_stages), Some(S::ALL_TRANSFER));
    }

    #[test]
    fn write_after_read_waits_for_every_reader() {
        let mut tracker = Tracker::default();
        tracker.access(R, false, Stage::Transfer, Access::TransferWrite);
        tracker.access(R, false, Stage::Compute, Access::StorageRead);
        tracker.access(R, false, Stage::RayTracing, Access::StorageRead);
        let barrier = tracker.access(R, false, Stage::Transfer, Access::TransferWrite);
        let stages = barrier.map(|b| b.source_stages).unwrap_or_default();
        assert!(stages.contains(S::COMPUTE_SHADER | S::RAY_TRACING_SHADER_KHR | S::ALL_TRANSFER));
    }

    #[test]
    fn write_after_write_is_ordered() {
        let mut tracker = Tracker::default();
        tracker.access(R, false, Stage::AccelBuild, Access::AccelWrite);
        let barrier = tracker.access(R, false, Stage::AccelBuild, Access::AccelWrite);
        assert_eq!(barrier.map(|b| b.source_stages), Some(S::ACCELERATION_STRUCTURE_BUILD_KHR));
    }

    #[test]
    fn an_image_changes_its_layout_once() {
        let mut tracker = Tracker::default();
        let first = tracker.access(R, true, Stage::Compute, Access::StorageWrite);
        assert_eq!(first.and_then(|b| b.layouts), Some((ImageLayout::UNDEFINED, ImageLayout::GENERAL)));
        let second = tracker.access(R, true, Stage::Compute, Access::Sampled);
        assert_eq!(
            second.and_then(|b| b.layouts),
            Some((ImageLayout::GENERAL, ImageLayout::SHADER_READ_ONLY_OPTIMAL))
        );
        assert_eq!(tracker.access(R, true, Stage::Compute, Access::Sampled), None);
    }

    #[test]
    fn a_read_after_a_transition_in_another_stage_waits_for_the_transition() {
        let mut tracker = Tracker::default();
        tracker.access(R, true, Stage::Compute, Access::StorageWrite);
        tracker.access(R, true, Stage::Compute, Access::Sampled);
        let barrier = tracker.access(R, true, Stage::RayTracing, Access::Sampled);
        assert_eq!(barrier.map(|b| b.source_stages), Some(S::COMPUTE_SHADER));
    }

    #[test]
    fn rolling_back_restores_what_was_committed() {
        let mut tracker = Tracker::default();
        tracker.access(R, true, Stage::Compute, Access::StorageWrite);
        tracker.commit();
        let before = tracker.states.clone();
        tracker.access(R, true, Stage::Compute, Access::Sampled);
        tracker.access(ResourceId(8), false, Stage::Compute, Access::StorageWrite);
        tracker.roll_back();
        assert_eq!(tracker.states, before);
    }
}
