//! Times of what has to be quick in large scenes. They are printed, and only gross blunders fail: a shared machine
//! is no clock. `cargo test --release -p caustica-scene speed -- --nocapture`.

use std::sync::Arc;
use std::time::{Duration, Instant};

use caustica_scene::import::Imported;
use caustica_scene::{
    Animation, Channel, ChannelPath, Document, Edit, Environment, Interpolation, Light, LightKind, Local,
    Material, MaterialId, Mesh, MeshData, MeshId, Node, NodeId, NodeKind, PartNode, Prefab, Primitive, Skin,
    SkinData, Subtree, Target, Trs,
};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

/// Far above what is meant (50 us), far below a walk through the scene with its allocations.
const BLUNDER: Duration = Duration::from_millis(5);

fn triangle() -> MeshData {
    MeshData {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3],
        tex_coords0: vec![Vec2::ZERO; 3],
        indices: vec![0, 1, 2],
        ..MeshData::default()
    }
}

fn mesh(data: MeshData) -> Mesh {
    let primitive = Primitive {
        first_index: 0,
        index_count: 3,
        material: MaterialId(0),
        mesh_from_primitive: DAffine3::IDENTITY,
    };
    Mesh::new("triangle".to_owned(), Arc::new(data), vec![primitive])
}

/// Rig like that of the usual fox: a chain of 24 joints, all of them turned by 80 keys.
fn fox() -> Imported {
    const JOINTS: u32 = 24;
    const KEYS: usize = 80;
    let mut parts =
        vec![PartNode { mesh: Some(MeshId(0)), skin: Some(0), visible: true, ..PartNode::default() }];
    for joint in 0..JOINTS {
        parts.push(PartNode {
            parent: joint.checked_sub(1).map(|above| above + 1),
            local: Trs::from_translation(DVec3::Y).into(),
            visible: true,
            ..PartNode::default()
        });
    }
    let channel = |part: u32| Channel {
        part,
        path: ChannelPath::Rotation,
        interpolation: Interpolation::Linear,
        times_s: (0..KEYS).map(|key| key as f32 / 24.0).collect(),
        values: (0..KEYS)
            .flat_map(|key| {
                let (sin, cos) = (key as f32 * 0.1 + part as f32).sin_cos();
                [0.0, 0.0, sin, cos]
            })
            .collect(),
    };
    let mut prefab = Prefab::new("fox", "fox.gltf");
    prefab.animations = vec![Arc::new(Animation::new("run", (1..=JOINTS).map(channel).collect()))];
    let joints = (1..=JOINTS).collect();
    prefab.set_skins(vec![Skin { joints, inverse_bind: vec![DAffine3::IDENTITY; JOINTS as usize] }]);
    prefab.set_nodes(parts).unwrap();
    let skin = SkinData { joints: vec![[1, 2, 0, 0]; 3], weights: vec![[0.5, 0.5, 0.0, 0.0]; 3] };
    let meshes = vec![mesh(MeshData { skin: Some(skin), ..triangle() })];
    Imported { prefab, meshes, materials: vec![Material::default()], ..Imported::default() }
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

#[test]
fn a_hundred_foxes_run() {
    const FOXES: usize = 100;
    let mut document = Document::new();
    let prefab = document.add_imported(fox()).unwrap();
    for i in 0..FOXES {
        let local = Local::Trs(Trs::from_translation(DVec3::X * i as f64));
        let (_, edit) = document.instantiate_edit(prefab, None, local);
        document.apply(edit).unwrap();
    }
    document.drain_changes();
    let (mut set, mut drain, mut poses) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..200 {
        let start = Instant::now();
        document.set_time(Some(f64::from(step) * 0.016));
        let laid = Instant::now();
        let changes = document.drain_changes();
        let drained = Instant::now();
        assert_eq!((changes.poses.len(), changes.transforms.len()), (FOXES, 0));
        for &target in &changes.poses {
            assert_eq!(document.deform_pose(target).unwrap().joint_matrices.len(), 24);
        }
        set.push(laid - start);
        drain.push(drained - laid);
        poses.push(drained.elapsed());
    }
    let [set, drain, poses] = [set, drain, poses].map(median);
    println!("100 foxes of 24 joints: set_time {set:?}, drain {drain:?}, all joint matrices {poses:?}");
    assert!(set + drain + poses < Duration::from_millis(100));
}

/// 100,000 meshes below 100 groups.
fn crowd() -> (Document, Vec<NodeId>) {
    let mut document = Document::new();
    let mut prefab = Prefab::new("thing", "thing.gltf");
    prefab.set_nodes(Vec::new()).unwrap();
    let meshes = vec![mesh(triangle())];
    let imported = Imported { prefab, meshes, materials: vec![Material::default()], ..Imported::default() };
    document.add_imported(imported).unwrap();
    let (mesh, material) = (document.meshes().next().unwrap().0, document.materials().next().unwrap().0);
    let mut leaves = Vec::new();
    for _ in 0..100 {
        let top = NodeId(document.allocate_id());
        let mut subtree = Subtree::single(top, Node::new("group", NodeKind::Group));
        for i in 0..1000 {
            let id = NodeId(document.allocate_id());
            let kind = NodeKind::Mesh { mesh, materials: vec![material], weights: Vec::new() };
            let mut node =
                Node::new("thing", kind).with_local(Trs::from_translation(DVec3::Z * f64::from(i)));
            node.parent = Some(top);
            subtree.nodes.push((id, node));
            leaves.push(id);
        }
        document.apply(Edit::AddNode { parent: None, index: usize::MAX, subtree }).unwrap();
    }
    document.drain_changes();
    (document, leaves)
}

#[test]
fn one_of_a_hundred_thousand_moves_hides_and_shines() {
    let (mut document, leaves) = crowd();
    let (material, dull) = document.materials().next().map(|(id, m)| (id, m.clone())).unwrap();
    let mesh = document.meshes().next().unwrap().0;
    let edits: [(&str, &dyn Fn(usize) -> Edit); 5] = [
        ("move", &|i| Edit::SetTransform {
            target: leaves[i * 499].into(),
            local: Trs::from_translation(DVec3::splat(i as f64 + 0.5)).into(),
        }),
        ("hide", &|i| Edit::SetVisible { target: leaves[i * 499].into(), visible: false }),
        ("rays", &|i| Edit::SetRayVisibility {
            target: leaves[i * 499].into(),
            camera_visible: false,
            casts_shadows: true,
        }),
        ("material", &|i| Edit::SetMaterial {
            material,
            value: Box::new(Material { roughness: i as f32 / 200.0, ..dull.clone() }),
        }),
        ("primitive", &|i| Edit::SetPrimitiveTransform {
            mesh,
            primitive: 0,
            mesh_from_primitive: DAffine3::from_translation(DVec3::X * i as f64),
        }),
    ];
    for (name, edit) in edits {
        let (mut apply, mut drain) = (Vec::new(), Vec::new());
        for i in 0..200 {
            let edit = edit(i);
            let start = Instant::now();
            document.apply(edit).unwrap();
            let applied = Instant::now();
            let changes = document.drain_changes();
            let bounds = changes.transforms.keys().filter_map(|&target| document.own_bounds(target)).count();
            let environment = document.effective_environment();
            drain.push(applied.elapsed());
            apply.push(applied - start);
            assert!(!changes.is_empty() && !changes.environment && changes.transforms.len() == bounds);
            assert_eq!(environment, Environment::DefaultSky);
        }
        let [apply, drain] = [apply, drain].map(median);
        println!("{name} one of 100,000: apply {apply:?}, drain {drain:?}");
        assert!(apply + drain < BLUNDER, "{name}");
    }
    let target = Target::node(leaves[0]);
    let lit = Material { emissive: Vec3::ONE, ..dull };
    document.apply(Edit::SetMaterial { material, value: Box::new(lit) }).unwrap();
    let start = Instant::now();
    assert!(document.drain_changes().environment && document.has_light());
    println!("a material of 100,000 starts to shine: drain {:?}", start.elapsed());
    assert!(document.renderable(target).is_some());
}

#[test]
fn what_begins_to_shine_beside_a_lamp_is_not_looked_for() {
    let (mut document, _) = crowd();
    let (material, dull) = document.materials().next().map(|(id, m)| (id, m.clone())).unwrap();
    let kind = LightKind::Point { radius_m: 0.0, range_m: None };
    let lamp = NodeKind::Light(Light { color: Vec3::ONE, intensity: 1.0, kind });
    let (lamp, edit) = document.add_edit(Node::new("lamp", lamp), None);
    document.apply(edit).unwrap();
    document.drain_changes();
    let set = |document: &mut Document, emissive| {
        let value = Box::new(Material { emissive, ..dull.clone() });
        let start = Instant::now();
        document.apply(Edit::SetMaterial { material, value }).unwrap();
        assert!(!document.drain_changes().environment);
        start.elapsed()
    };
    let times = (0..20).map(|i| set(&mut document, Vec3::splat(f32::from(i % 2 == 0)))).collect();
    let time = median(times);
    println!("a material of 100,000 beside a lamp starts or stops to shine: {time:?}");
    assert!(time < BLUNDER);
    // Without the lamp it counts that the last word was: dark.
    let undo = document.apply(Edit::RemoveNode { node: lamp }).unwrap();
    assert!(document.drain_changes().environment);
    assert_eq!(document.effective_environment(), Environment::DefaultSky);
    document.apply(undo).unwrap();
    document.drain_changes();
    set(&mut document, Vec3::ONE);
    document.apply(Edit::RemoveNode { node: lamp }).unwrap();
    assert!(!document.drain_changes().environment && document.has_light());
}

#[test]
fn a_primitive_is_moved_without_a_look_at_its_vertices() {
    const TRIANGLES: u32 = 1_000_000;
    let mut document = Document::new();
    let data = MeshData { indices: [0, 1, 2].repeat(TRIANGLES as usize), ..triangle() };
    let mut whole = mesh(data);
    let primitives = vec![Primitive { index_count: TRIANGLES * 3, ..whole.primitives[0] }];
    whole = Mesh::new(whole.name, whole.data, primitives);
    let mut prefab = Prefab::new("thing", "thing.gltf");
    prefab.set_nodes(Vec::new()).unwrap();
    let materials = vec![Material::default()];
    document
        .add_imported(Imported { prefab, meshes: vec![whole], materials, ..Imported::default() })
        .unwrap();
    let mesh = document.meshes().next().unwrap().0;
    let mut times = Vec::new();
    for step in 1..20 {
        let mesh_from_primitive = DAffine3::from_translation(DVec3::X * f64::from(step));
        let start = Instant::now();
        document.apply(Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive }).unwrap();
        times.push(start.elapsed());
        let (low, high) = document.mesh(mesh).unwrap().bounds.unwrap();
        assert_eq!((low.x, high.x), (f64::from(step), f64::from(step) + 1.0));
    }
    let time = median(times);
    println!("a primitive of {TRIANGLES} triangles moves: {time:?}");
    assert!(time < BLUNDER);
}

#[test]
fn a_time_does_not_walk_what_stands_still() {
    let (mut document, _) = crowd();
    let prefab = document.add_imported(fox()).unwrap();
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    document.drain_changes();
    let mut times = Vec::new();
    for step in 0..200 {
        let start = Instant::now();
        document.set_time(Some(f64::from(step) * 0.016));
        let changes = document.drain_changes();
        let duration_s = document.animation_duration();
        times.push(start.elapsed());
        assert_eq!((changes.poses.len(), duration_s.is_some()), (1, true));
    }
    let time = median(times);
    println!("one fox among 100,000 nodes: set_time and drain {time:?}");
    assert!(time < BLUNDER);
}
