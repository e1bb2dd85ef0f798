//! Between world space and the view on the screen, in double precision. Enters: a camera and the size of the view.
//! Leaves: points for places, rays for points. Points are egui's, from the view's upper left corner, y down.

use caustica_scene::Projection;
use glam::{DAffine3, DVec2, DVec3};

/// A half-line in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, metres.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

impl Ray {
    /// Where the ray meets the plane through `point` with the unit `normal`; `None` when it runs along the plane or
    /// away from it.
    pub fn meet_plane(&self, point: DVec3, normal: DVec3) -> Option<DVec3> {
        let slope = normal.dot(self.direction);
        let distance = normal.dot(point - self.origin) / slope;
        (slope.abs() > 1e-9 && distance.is_finite() && distance >= 0.0)
            .then(|| self.origin + self.direction * distance)
    }

    /// How far along the line through `point` in the unit `direction` the place nearest to this ray's line lies;
    /// `None` when both run the same way.
    pub fn nearest_on_line(&self, point: DVec3, direction: DVec3) -> Option<f64> {
        let between = point - self.origin;
        let b = direction.dot(self.direction);
        let denominator = 1.0 - b * b;
        let along = (b * self.direction.dot(between) - direction.dot(between)) / denominator;
        (denominator > 1e-7 && along.is_finite()).then_some(along)
    }
}

/// How a camera puts the world on a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewProjection {
    world_from_camera: DAffine3,
    camera_from_world: DAffine3,
    lens: Lens,
    size: DVec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lens {
    Perspective { tan_half_y: f64 },
    Orthographic { half_height_m: f64 },
}

impl ViewProjection {
    /// `world_from_camera` is rigid and looks along -Z with +Y up; `size` is in points.
    pub fn new(world_from_camera: DAffine3, projection: Projection, size: DVec2) -> Self {
        let lens = match projection {
            Projection::Perspective { yfov_rad } => {
                Lens::Perspective { tan_half_y: (f64::from(yfov_rad) * 0.5).tan() }
            }
            Projection::Orthographic { ymag_m } => Lens::Orthographic { half_height_m: f64::from(ymag_m) },
        };
        Self {
            world_from_camera,
            camera_from_world: world_from_camera.inverse(),
            lens,
            size: size.max(DVec2::ONE),
        }
    }

    /// Where the camera stands, metres.
    pub fn eye(&self) -> DVec3 {
        self.world_from_camera.translation
    }

    /// Unit direction in which the camera looks.
    pub fn forward(&self) -> DVec3 {
        -self.world_from_camera.matrix3.z_axis
    }

    /// Unit direction to the right of the picture.
    pub fn right(&self) -> DVec3 {
        self.world_from_camera.matrix3.x_axis
    }

    /// Unit direction to the top of the picture.
    pub fn up(&self) -> DVec3 {
        self.world_from_camera.matrix3.y_axis
    }

    /// Unit direction from a place towards the camera.
    pub fn towards_eye(&self, world: DVec3) -> DVec3 {
        match self.lens {
            Lens::Perspective { .. } => (self.eye() - world).normalize_or(-self.forward()),
            Lens::Orthographic { .. } => -self.forward(),
        }
    }

    /// Points of a place; `None` when it lies behind the camera.
    pub fn project(&self, world: DVec3) -> Option<DVec2> {
        let at = self.camera_from_world.transform_point3(world);
        let half_height = self.half_height_at(-at.z)?;
        let scale = self.size.y * 0.5 / half_height;
        let points = DVec2::new(self.size.x * 0.5 + at.x * scale, self.size.y * 0.5 - at.y * scale);
        points.is_finite().then_some(points)
    }

    /// The ray through a point of the view.
    pub fn ray(&self, points: DVec2) -> Ray {
        let from_center = (points - self.size * 0.5) / (self.size.y * 0.5);
        let (x, y) = (from_center.x, -from_center.y);
        match self.lens {
            Lens::Perspective { tan_half_y } => Ray {
                origin: self.eye(),
                direction: self
                    .world_from_camera
                    .transform_vector3(DVec3::new(x * tan_half_y, y * tan_half_y, -1.0))
                    .normalize_or(self.forward()),
            },
            Lens::Orthographic { half_height_m } => Ray {
                origin: self.world_from_camera.transform_point3(DVec3::new(
                    x * half_height_m,
                    y * half_height_m,
                    0.0,
                )),
                direction: self.forward(),
            },
        }
    }

    /// Metres that one point of the view covers at the depth of a place; of the eye's nearest depth behind it.
    pub fn metres_per_point(&self, world: DVec3) -> f64 {
        let depth = -self.camera_from_world.transform_point3(world).z;
        let half_height = self.half_height_at(depth.max(1e-9)).unwrap_or(1.0);
        half_height * 2.0 / self.size.y
    }

    fn half_height_at(&self, depth: f64) -> Option<f64> {
        match self.lens {
            Lens::Perspective { tan_half_y } => (depth > 1e-12).then_some(depth * tan_half_y),
            Lens::Orthographic { half_height_m } => Some(half_height_m),
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use glam::DQuat;

    use super::*;

    fn view(projection: Projection) -> ViewProjection {
        let turned = DQuat::from_euler(glam::EulerRot::YXZ, 0.7, -0.3, 0.1);
        let camera = DAffine3::from_rotation_translation(turned, DVec3::new(3.0, 2.0, -5.0));
        ViewProjection::new(camera, projection, DVec2::new(800.0, 600.0))
    }

    #[test]
    fn a_ray_through_a_projected_place_meets_it() {
        for projection in
            [Projection::Perspective { yfov_rad: 0.8 }, Projection::Orthographic { ymag_m: 4.0 }]
        {
            let view = view(projection);
            for offset in [DVec2::new(0.0, 0.0), DVec2::new(250.0, -120.0), DVec2::new(-390.0, 290.0)] {
                let point = DVec2::new(400.0, 300.0) + offset;
                let ray = view.ray(point);
                let place = ray.origin + ray.direction * 12.5;
                let again = view.project(place).unwrap();
                assert!((again - point).length() < 1e-6, "{point} came back as {again}");
            }
        }
    }

    #[test]
    fn what_is_behind_a_perspective_camera_has_no_point() {
        let view = view(Projection::Perspective { yfov_rad: 0.8 });
        assert_eq!(view.project(view.eye() - view.forward()), None);
    }

    #[test]
    fn a_point_covers_the_metres_it_says() {
        let view = view(Projection::Perspective { yfov_rad: 0.8 });
        let place = view.eye() + view.forward() * 7.0;
        let step = view.right() * view.metres_per_point(place) * 10.0;
        let moved = view.project(place + step).unwrap() - view.project(place).unwrap();
        assert!((moved - DVec2::new(10.0, 0.0)).length() < 1e-9);
    }

    #[test]
    fn nearest_on_line_is_exact() {
        let ray = Ray { origin: DVec3::new(2.0, 5.0, 0.0), direction: DVec3::NEG_Y };
        let along = ray.nearest_on_line(DVec3::new(0.0, 0.0, 3.0), DVec3::X).unwrap();
        assert!((along - 2.0).abs() < 1e-12);
        assert_eq!(ray.nearest_on_line(DVec3::ZERO, DVec3::Y), None);
    }
}
