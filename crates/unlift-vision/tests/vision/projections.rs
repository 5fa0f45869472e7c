//! Projection of maps and occlusion.

use unlift_vision::pictures::{Lens, View};

const SIZE: [usize; 2] = [640, 480];

fn view() -> View {
    View {
        center: [1.0, 2.0, 3.0],
        // Looks along the world's x axis; right is -y.
        rotation: [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]],
        lens: Lens::try_new("PINHOLE", &[500.0, 500.0, 320.0, 240.0]).unwrap(),
        size: SIZE,
    }
}

#[test]
fn points_are_where_the_camera_sees_them() {
    let points = [
        Some([3.0, 2.0, 3.0]),
        None,
        Some([0.0, 2.0, 3.0]),
        Some([3.0, 1.0, 2.5]),
        Some([3.0, 2.0, f64::NAN]),
        Some([3.0, -5.0, 3.0]),
    ];
    let found = view().project(&points).unwrap();
    // One point straight ahead, one to the right and below; the others are unknown, behind or
    // outside.
    assert_eq!(found.points, [0, 3]);
    assert_eq!(found.places, [[319.5, 239.5], [569.5, 364.5]]);
    assert_eq!(found.depths[0], 2.0);
    assert!((found.depths[1] - (4.0_f32 + 1.0 + 0.25).sqrt()).abs() < 1e-6);
}

#[test]
fn a_wall_hides_what_is_behind_it() {
    // Two walls, the near one over the left half, with a grid of points 4 pixels apart on each.
    let wall = |depth: f64, columns: std::ops::Range<i32>| {
        columns.flat_map(move |x| (-40..40).map(move |y| (x, y))).map(move |(x, y)| {
            let [across, down] = [x, y].map(|at| (4.0 * f64::from(at) + 1.0) / 500.0 * depth);
            Some([1.0 + depth, 2.0 - across, 3.0 - down])
        })
    };
    let near: Vec<_> = wall(2.0, -60..0).collect();
    let points: Vec<_> = near.iter().copied().chain(wall(3.0, -60..60)).collect();
    let found = view().project(&points).unwrap();
    assert_eq!(found.points.len(), points.len());
    let visible = found.visible(SIZE);
    let mut wrong = 0;
    for ((point, place), visible) in found.points.iter().zip(&found.places).zip(visible) {
        let truly = (*point as usize) < near.len() || place[0] > 320.0;
        // Windows extend across the edge of the near wall.
        if (place[0] - 320.0).abs() > 16.0 && place[0] > 84.0 {
            wrong += usize::from(truly != visible);
        }
    }
    assert_eq!(wrong, 0);
}

#[test]
fn a_few_errors_before_a_wall_hide_nothing() {
    let mut points: Vec<_> = (-30..30)
        .flat_map(|x| (-30..30).map(move |y| (x, y)))
        .map(|(x, y)| Some([4.0, 2.0 - f64::from(x) * 0.02, 3.0 - f64::from(y) * 0.02]))
        .collect();
    points.extend([Some([2.0, 2.0, 3.0]), Some([2.0, 2.01, 3.0])]);
    let found = view().project(&points).unwrap();
    assert!(found.visible(SIZE).into_iter().all(|visible| visible));
}
