//! Builds the package again when a shader is added or removed: the folder is embedded in the binary.

fn main() {
    println!("cargo:rerun-if-changed=../shaders");
}
