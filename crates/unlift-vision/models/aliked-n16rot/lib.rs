//! The network ALIKED (n16rot): keypoints and descriptors of photos.
#![no_std]

/// The ONNX file.
pub static ONNX: &[u8] = include_bytes!("aliked-n16rot.onnx");
