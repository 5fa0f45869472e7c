//! Cameras: their poses, and the pixels at which a pinhole sees directions.

use super::vector::{distance, dot, sub};
use crate::seed::Draws;

/// The pose of a camera: a point `x` is at `rotation (x - center)` in the frame right, down, forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation from the world to the camera.
    pub rotation: [[f64; 3]; 3],
    /// The center of the camera in the world.
    pub center: [f64; 3],
}

/// An error of a pose, or a standard deviation of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// Distance of the centers, in the unit of the points.
    pub center: f64,
    /// Angle between the rotations in degrees.
    pub rotation_degrees: f64,
}

/// Focal lengths and principal point of a pinhole camera, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths.
    pub focal: [f64; 2],
    /// Principal point.
    pub principal: [f64; 2],
}

/// A pinhole camera with its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Focal lengths and principal point.
    pub intrinsics: Intrinsics,
    /// The pose.
    pub pose: Pose,
}

impl Pose {
    /// The pose of a camera in the origin that looks along the third axis.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], center: [0.0; 3] };

    /// Returns the place of a point in the frame of the camera.
    pub fn in_camera(&self, point: &[f64; 3]) -> [f64; 3] {
        let away = sub(point, &self.center);
        self.rotation.map(|row| dot(&row, &away))
    }

    /// Returns the place of the world's origin in the frame of the camera.
    pub fn translation(&self) -> [f64; 3] {
        self.rotation.map(|row| -dot(&row, &self.center))
    }

    /// Returns the error of this pose, given the true one.
    pub fn error(&self, truth: &Self) -> PoseError {
        let trace: f64 = (0..3).map(|k| dot(&self.rotation[k], &truth.rotation[k])).sum();
        let angle = libm::acos(((trace - 1.0) / 2.0).clamp(-1.0, 1.0));
        let center = distance(&self.center, &truth.center);
        PoseError { center, rotation_degrees: angle.to_degrees() }
    }

    /// Returns this pose with an error in random directions.
    #[must_use]
    pub fn with_error(&self, error: PoseError, draws: &mut Draws) -> Self {
        let (axis, direction): ([f64; 3], [f64; 3]) = (draws.direction(), draws.direction());
        let angle = error.rotation_degrees.to_radians();
        Self {
            rotation: turned(&axis.map(|x| x * angle), &self.rotation),
            center: [0, 1, 2].map(|c| self.center[c] + error.center * direction[c]),
        }
    }

    /// Returns the pose moved by a small rotation and translation in its own frame: `w`, then `dt`.
    #[must_use]
    pub fn moved(&self, by: &[f64; 6]) -> Self {
        let (w, dt) = ([by[0], by[1], by[2]], [by[3], by[4], by[5]]);
        let rotation = turned(&w, &self.rotation);
        // The center moves by -R^T dt.
        let center = std::array::from_fn(|c| {
            self.center[c] - (0..3).map(|k| rotation[k][c] * dt[k]).sum::<f64>()
        });
        Self { rotation, center }
    }
}

impl Camera {
    /// Projects a point into the image, in pixels; `None` behind the camera.
    pub fn project(&self, point: &[f64; 3]) -> Option<[f64; 2]> {
        let x = self.pose.in_camera(point);
        let Intrinsics { focal, principal } = &self.intrinsics;
        let on = |c: usize| focal[c] * x[c] / x[2] + principal[c];
        (x[2] > 0.0).then(|| [on(0), on(1)])
    }

    /// Returns the matrix `K [R | t]`.
    pub(crate) fn projection(&self) -> [[f64; 4]; 3] {
        let t = self.pose.translation();
        let rows = [0, 1, 2].map(|r| {
            let [x, y, z] = self.pose.rotation[r];
            [x, y, z, t[r]]
        });
        let Intrinsics { focal, principal } = &self.intrinsics;
        let scaled =
            |r: usize| [0, 1, 2, 3].map(|c| focal[r] * rows[r][c] + principal[r] * rows[2][c]);
        [scaled(0), scaled(1), rows[2]]
    }
}

/// Returns `rotation`, followed by the rotation by the angle `|w|` about `w` (Rodrigues).
fn turned(w: &[f64; 3], rotation: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let angle = dot(w, w).sqrt();
    let (sine, versine) = match angle > 1e-12 {
        true => (libm::sin(angle) / angle, (1.0 - libm::cos(angle)) / (angle * angle)),
        false => (1.0, 0.5),
    };
    let cross = [[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]];
    let turn: [[f64; 3]; 3] = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let square: f64 = (0..3).map(|k| cross[r][k] * cross[k][c]).sum();
            f64::from(u8::from(r == c)) + sine * cross[r][c] + versine * square
        })
    });
    turn.map(|row| std::array::from_fn(|c| (0..3).map(|k| row[k] * rotation[k][c]).sum()))
}
