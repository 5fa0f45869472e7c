//! Stage files: the Parquet tables that commands exchange, each of one kind, or a folder of its
//! parts.
//!
//! `docs/formats.md` describes them for writers in other languages. Released maps, neighborhoods
//! and recovered points contain nothing of the ground truth: no ids, names or times of their
//! source. Equal values make equal bytes.
//!
//! Readers accept numbers of any width, lists of any type, null or NaN for missing values, and
//! missing metadata and columns that can be inferred. Any other deviation is one line that names
//! the file, the column and row (counted from 0), what was expected and what was found.

mod column;
mod file;
mod footer;
mod header;
mod image_writer;
mod images;
mod manifest;
mod neighborhoods;
mod order;
mod pages;
mod parts;
mod peek;
mod recovered;
mod released;
mod table;
mod thrift;
mod truth;
mod write;

pub use header::Kind;
pub use image_writer::ImageWriter;
pub use images::{ImageFile, ImageRows, has_images};
pub use neighborhoods::{
    PointNeighborhoods, read_neighborhoods, read_point_neighborhoods, write_neighborhoods,
};
pub use parts::part_files;
pub use peek::{Header, declared_kind, peek};
pub use recovered::{read_recovered, read_recovered_in, write_recovered};
pub use released::{read_released, scheme_name, write_released};
pub use truth::{read_truth, write_truth};
