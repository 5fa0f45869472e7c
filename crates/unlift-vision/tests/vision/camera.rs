//! Every camera model of COLMAP, compared with COLMAP 4.2; projection of maps and occlusion.

use unlift::geometry::camera::Pose;
use unlift_vision::pictures::{Lens, View};

/// Points in the camera's frame.
const POINTS: [[f64; 3]; 5] =
    [[0.0, 0.0, 2.0], [0.3, -0.2, 1.5], [-0.7, 0.4, 1.1], [1.2, 0.9, 1.4], [-0.1, -1.1, 1.6]];

type Seen = (&'static str, &'static [f64], [[f64; 2]; 5]);

/// Model, parameters, and `pycolmap.Camera.img_from_cam` of each point, from the corner.
#[rustfmt::skip]
const SEEN: [Seen; 18] = [
    ("SIMPLE_PINHOLE", &[500.0, 320.0, 240.0], [[320.0, 240.0], [420.0, 173.333333], [1.818182, 421.818182], [748.571429, 561.428571], [288.75, -103.75]]),
    ("PINHOLE", &[500.0, 510.0, 320.0, 240.0], [[320.0, 240.0], [420.0, 172.0], [1.818182, 425.454545], [748.571429, 567.857143], [288.75, -110.625]]),
    ("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, -0.05], [[320.0, 240.0], [419.711111, 173.525926], [10.364388, 416.934636], [723.972303, 542.979227], [289.494629, -95.559082]]),
    ("RADIAL", &[500.0, 320.0, 240.0, -0.05, 0.02], [[320.0, 240.0], [419.717788, 173.521475], [8.528013, 417.983993], [735.26782, 551.450865], [289.352684, -97.120476]]),
    ("OPENCV", &[500.0, 510.0, 320.0, 240.0, -0.05, 0.02, 0.003, -0.002], [[320.0, 240.0], [419.50001, 172.389104], [6.486691, 423.242268], [734.303534, 559.57677], [288.997215, -101.775073]]),
    ("OPENCV_FISHEYE", &[400.0, 410.0, 320.0, 240.0, -0.02, 0.01, 0.003, -0.001], [[320.0, 240.0], [398.425656, 186.409135], [101.707982, 367.856753], [580.201373, 440.029806], [298.246756, -5.267828]]),
    ("FULL_OPENCV", &[500.0, 510.0, 320.0, 240.0, -0.05, 0.02, 0.003, -0.002, 0.01, 0.02, -0.01, 0.004], [[320.0, 240.0], [419.388351, 172.465033], [8.6161, 422.001126], [734.213728, 559.508068], [289.197622, -99.526504]]),
    ("FOV", &[500.0, 510.0, 320.0, 240.0, 0.9], [[320.0, 240.0], [425.476056, 168.276282], [22.801704, 413.22415], [676.734423, 512.901834], [290.415352, -91.939745]]),
    ("SIMPLE_RADIAL_FISHEYE", &[400.0, 320.0, 240.0, -0.02], [[320.0, 240.0], [398.423185, 187.717876], [102.096076, 364.516528], [578.830483, 434.122862], [298.278723, 1.065955]]),
    ("RADIAL_FISHEYE", &[400.0, 320.0, 240.0, -0.02, 0.01], [[320.0, 240.0], [398.425616, 187.716256], [101.744545, 364.717403], [580.01589, 435.011918], [298.249561, 0.745171]]),
    ("THIN_PRISM_FISHEYE", &[400.0, 410.0, 320.0, 240.0, -0.02, 0.01, 0.003, -0.002, 0.004, -0.001, 0.002, -0.003], [[320.0, 240.0], [398.302392, 186.493366], [100.797827, 368.389844], [580.367094, 440.157203], [298.319902, -4.443104]]),
    ("RAD_TAN_THIN_PRISM_FISHEYE", &[400.0, 410.0, 320.0, 240.0, -0.02, 0.01, 0.003, -0.002, 0.001, -0.0005, 0.002, -0.003, 0.001, -0.002, 0.003, -0.001], [[320.0, 240.0], [398.612832, 186.323813], [102.945943, 367.272212], [580.530771, 439.762808], [298.502508, -6.145091]]),
    ("SIMPLE_DIVISION", &[500.0, 320.0, 240.0, -0.05], [[320.0, 240.0], [419.712768, 173.524821], [9.933975, 417.180585], [726.446586, 544.834939], [289.461125, -95.927626]]),
    ("DIVISION", &[500.0, 510.0, 320.0, 240.0, -0.05], [[320.0, 240.0], [419.712768, 172.195318], [9.933975, 420.724197], [726.446586, 550.931638], [289.461125, -102.646178]]),
    ("SIMPLE_FISHEYE", &[400.0, 320.0, 240.0], [[320.0, 240.0], [398.510562, 187.659625], [100.338603, 365.520798], [582.357525, 436.768143], [298.118961, -0.691428]]),
    ("FISHEYE", &[400.0, 410.0, 320.0, 240.0], [[320.0, 240.0], [398.510562, 186.351116], [100.338603, 368.658818], [582.357525, 441.687347], [298.118961, -6.708714]]),
    ("EUCM", &[400.0, 410.0, 320.0, 240.0, 0.55, 1.1], [[320.0, 240.0], [398.646605, 186.258153], [97.441119, 370.355916], [588.415966, 446.344774], [297.857018, -9.66212]]),
    ("EQUIRECTANGULAR", &[1280.0, 640.0], [[640.0, 320.0], [680.213093, 293.515261], [524.546872, 380.640996], [784.360159, 412.503836], [627.284144, 197.488354]]),
];

#[test]
fn lenses_project_as_colmap_does_and_undistortion_is_the_inverse() {
    for (model, params, seen) in SEEN {
        let lens = Lens::try_new(model, params).unwrap();
        for (point, expected) in POINTS.into_iter().zip(seen) {
            let place = lens.project(point).unwrap();
            let apart = (0..2).map(|c| (place[c] + 0.5 - expected[c]).abs()).fold(0.0, f64::max);
            assert!(apart < 2e-6, "{model} {point:?}: {place:?}, not {expected:?}");
            let flat = lens.undistort(place).unwrap_or_else(|| panic!("{model} {point:?}"));
            let expected = [point[0] / point[2], point[1] / point[2]];
            let apart = (0..2).map(|c| (flat[c] - expected[c]).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-4, "{model} {point:?}: {flat:?}, not {expected:?}");
        }
    }
}

#[test]
fn points_behind_a_camera_or_beyond_a_fold_have_no_position() {
    let plain = Lens::try_new("PINHOLE", &[500.0, 500.0, 320.0, 240.0]).unwrap();
    assert_eq!(plain.project([0.1, 0.1, -1.0]), None);
    assert_eq!(plain.project([0.0, 0.0, 0.0]), None);
    // This polynomial has its maximum at a radius of 1.15; points beyond would fold back.
    let folding = Lens::try_new("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, -0.25]).unwrap();
    assert!(folding.project([1.1, 0.0, 1.0]).is_some());
    assert_eq!(folding.project([1.2, 0.0, 1.0]), None);
    // The first folds at a radius of 1 and rises again from 1.41; the second has a pole at 1.83.
    let rising = Lens::try_new("RADIAL", &[500.0, 320.0, 240.0, -0.5, 0.1]).unwrap();
    assert!(rising.project([0.9, 0.0, 1.0]).is_some());
    assert_eq!(rising.project([1.5, 0.0, 1.0]), None);
    let pole = [500.0, 500.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0];
    assert_eq!(Lens::try_new("FULL_OPENCV", &pole).unwrap().project([8.0, 0.0, 1.0]), None);
    // A fisheye lens covers more than a half-space.
    let wide = Lens::try_new("SIMPLE_FISHEYE", &[200.0, 320.0, 240.0]).unwrap();
    assert!(wide.project([1.0, 0.0, -0.1]).is_some());
}

#[test]
fn wrong_cameras_are_one_line() {
    let text = |model: &str, params: &[f64]| Lens::try_new(model, params).unwrap_err().to_string();
    assert_eq!(text("PINHOLE", &[1.0; 3]), "PINHOLE: expected 4 parameters, found 3");
    assert_eq!(text("MIRROR", &[]), "camera model: expected one of COLMAP's, found MIRROR");
    let line = "EQUIRECTANGULAR: expected finite parameters, found NaN";
    assert_eq!(text("EQUIRECTANGULAR", &[1.0, f64::NAN]), line);
}

const SIZE: [usize; 2] = [640, 480];

fn view() -> View {
    View {
        pose: Pose {
            center: [1.0, 2.0, 3.0],
            // Looks along the world's x axis; right is -y.
            rotation: [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]],
        },
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
    // One point straight ahead, one to the right and below; others are unknown, behind or outside.
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
