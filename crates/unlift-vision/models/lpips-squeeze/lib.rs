//! The network LPIPS 0.1 (SqueezeNet): how different two pictures look.
#![no_std]

/// The ONNX file.
pub static ONNX: &[u8] = include_bytes!("lpips-squeeze.onnx");
