//! Points and lines for any viewer: PLY clouds colored by error, OBJ lines in a box, COLMAP models, nerfstudio's cameras.

mod colmap;
mod color;
mod nerfstudio;
mod obj;
mod ply;
mod segments;

pub use colmap::{write_cameras, write_images, write_model_points};
pub use color::error_color;
pub use nerfstudio::{NERFSTUDIO_CLOUD, write_transforms};
pub use obj::write_lines;
pub use ply::{write_points, write_recovered};
pub use segments::{Segment, clip_line_to_box, clip_ray_to_box, record_segments};
