//! Ray-tracing pipelines of the renderer: which stages, and how they become a pipeline. Enters: a ray generation shader and needs.
//! Leaves: a pipeline, made at once, or linked of groups that are compiled by themselves where shaders are edited.

use std::sync::{Arc, Mutex, PoisonError};

use caustica_gpu::{HitGroup, Interface, RayGroup, RayGroupDesc, RayTracingDesc, RayTracingPipeline};

use super::Frame;
use crate::error::Result;
use crate::needs::Needs;
use crate::shader::{Compiled, StageOf, check_payloads, merge_interfaces};

/// The stages of a ray-tracing pipeline.
#[derive(Clone, Copy)]
pub(super) struct RayFiles {
    generation: &'static str,
    any_hit: Option<[&'static str; 2]>,
    /// Closest hit and intersection.
    shapes: Option<[&'static str; 2]>,
}

/// Miss shaders of the kinds of rays, in the order of RAY_SURFACE and RAY_SHADOW.
const MISSES: [&str; 2] = ["passes/rays/surface.rmiss", "passes/rays/shadow.rmiss"];
const CLOSEST_HIT: &str = "passes/rays/surface.rchit";

impl RayFiles {
    pub(super) fn of(generation: &'static str, needs: Needs) -> Self {
        let any_hit = ["passes/rays/surface.rahit", "passes/rays/shadow.rahit"];
        let shapes = ["passes/rays/shape.rchit", "passes/rays/shape.rint"];
        Self { generation, any_hit: needs.any_hit.then_some(any_hit), shapes: needs.shapes.then_some(shapes) }
    }

    pub(super) fn all(&self) -> Vec<&'static str> {
        let optional = self.any_hit.into_iter().chain(self.shapes).flatten();
        [self.generation].into_iter().chain(MISSES).chain([CLOSEST_HIT]).chain(optional).collect()
    }
}

/// Makes the pipeline of these files. `linked`: the groups that are known, where stages are edited.
pub(super) fn make(
    frame: &Frame,
    files: &RayFiles,
    linked: Option<&Mutex<Linked>>,
    stage: StageOf<'_>,
) -> Result<RayTracingPipeline> {
    let pair = |files: [&str; 2]| -> Result<[Arc<Compiled>; 2]> { Ok([stage(files[0])?, stage(files[1])?]) };
    let generation = stage(files.generation)?;
    let (misses, closest_hit) = (pair(MISSES)?, stage(CLOSEST_HIT)?);
    let (any_hit, shapes) = (files.any_hit.map(pair).transpose()?, files.shapes.map(pair).transpose()?);
    let mut others = vec![&*misses[0], &*misses[1], &*closest_hit];
    others.extend(any_hit.iter().chain(&shapes).flatten().map(|stage| &**stage));
    check_payloads(&generation, &others)?;
    let interface = merge_interfaces(&[&[&*generation], &others[..]].concat())?;
    let [surface_any, shadow_any] = optional(any_hit);
    let [shape_hit, intersection] = optional(shapes);
    // In the order of RAY_SURFACE and RAY_SHADOW; then the same for shapes (RAY_SHAPES).
    let mut hits = vec![[Some(closest_hit), surface_any.clone(), None], [None, shadow_any.clone(), None]];
    if intersection.is_some() {
        hits.push([shape_hit, surface_any, intersection.clone()]);
        hits.push([None, shadow_any, intersection]);
    }
    let stages = Stages { generation, misses, hits };
    match linked {
        Some(linked) => stages.link(frame, &interface, linked),
        None => stages.pipeline(frame, &interface),
    }
}

fn optional(pair: Option<[Arc<Compiled>; 2]>) -> [Option<Arc<Compiled>>; 2] {
    pair.map_or([None, None], |pair| pair.map(Some))
}

/// The stages of a group: closest hit, any hit, intersection; of others the first alone.
type GroupStages = [Option<Arc<Compiled>>; 3];

/// All stages of a pipeline.
struct Stages {
    generation: Arc<Compiled>,
    misses: [Arc<Compiled>; 2],
    hits: Vec<GroupStages>,
}

/// Groups that were compiled by themselves, with what they were compiled of.
#[derive(Default)]
pub(super) struct Linked {
    interface: Interface,
    groups: Vec<(GroupStages, Arc<RayGroup>)>,
}

fn hit_group(stages: &GroupStages) -> HitGroup<'_> {
    let [closest_hit, any_hit, intersection] =
        stages.each_ref().map(|stage| stage.as_ref().map(|stage| &stage.module));
    HitGroup { closest_hit, any_hit, intersection }
}

fn same(a: &GroupStages, b: &GroupStages) -> bool {
    a.iter().zip(b).all(|(a, b)| match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    })
}

impl Stages {
    /// All of them at once.
    fn pipeline(&self, frame: &Frame, interface: &Interface) -> Result<RayTracingPipeline> {
        let hit_groups: Vec<HitGroup<'_>> = self.hits.iter().map(hit_group).collect();
        let desc = RayTracingDesc {
            name: frame.label,
            ray_generation: &self.generation.module,
            misses: &self.misses.each_ref().map(|stage| &stage.module),
            hit_groups: &hit_groups,
        };
        let Frame { device, specialization, .. } = frame;
        Ok(RayTracingPipeline::new(device, &desc, interface, specialization, frame.scene())?)
    }

    /// Each group by itself, those alone that are not known yet.
    fn link(
        &self,
        frame: &Frame,
        interface: &Interface,
        linked: &Mutex<Linked>,
    ) -> Result<RayTracingPipeline> {
        let alone = |stage: &Arc<Compiled>| [Some(Arc::clone(stage)), None, None];
        let general = [&self.generation].into_iter().chain(&self.misses).map(alone);
        let mut known = linked.lock().unwrap_or_else(PoisonError::into_inner);
        if known.interface != *interface {
            *known = Linked { interface: interface.clone(), groups: Vec::new() };
        }
        let mut groups = Vec::new();
        for (place, stages) in general.chain(self.hits.iter().cloned()).enumerate() {
            let group = match known.groups.get(place).filter(|(of, _)| same(of, &stages)) {
                Some((_, group)) => Arc::clone(group),
                None => Arc::new(self.group(frame, interface, place, &stages)?),
            };
            groups.push((stages, group));
        }
        let linked = groups.iter().map(|(_, group)| Arc::clone(group)).collect();
        known.groups = groups;
        let Frame { device, label, .. } = frame;
        let misses = self.misses.len() as u32;
        Ok(RayTracingPipeline::link(device, label, linked, misses, interface, frame.scene())?)
    }

    /// `place`: in the order of the pipeline's groups.
    fn group(
        &self,
        frame: &Frame,
        interface: &Interface,
        place: usize,
        stages: &GroupStages,
    ) -> Result<RayGroup> {
        let desc = match (place.checked_sub(1), &stages[0]) {
            (None, Some(generation)) => RayGroupDesc::Generation(&generation.module),
            (Some(miss), Some(stage)) if miss < self.misses.len() => RayGroupDesc::Miss(&stage.module),
            _ => RayGroupDesc::Hit(hit_group(stages)),
        };
        let Frame { label, device, specialization, .. } = frame;
        Ok(RayGroup::new(device, label, desc, interface, specialization, frame.scene())?)
    }
}
