//! stub
use crate::delta::InstanceId;
pub(crate) struct Deforming;
pub(crate) struct DeformingMesh;
impl DeformingMesh {
    pub(crate) fn triangles(&self, _: usize, _: bool) -> caustica_gpu::TriangleGeometry {
        unreachable!()
    }
}
impl Deforming {
    pub(crate) fn get(&self, _: InstanceId) -> Option<&DeformingMesh> {
        None
    }
    pub(crate) fn growth(&self, _: InstanceId) -> Option<f64> {
        None
    }
}
