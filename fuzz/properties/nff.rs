//! What must hold of the NFF reader and writer for any bytes. Shared by the fuzz target and by the
//! ordinary test that replays the corpus.

use ropewalk_scene::{NffLimits, NffWriter, NumberFormat, Scene};

/// Small, so that a short input reaches each of them.
const LIMITS: NffLimits = NffLimits {
    bytes: 1 << 20,
    objects: 1_000,
    vertices_per_polygon: 500,
    materials: 100,
    lights: 50,
    token_bytes: 64,
};

/// Reads `bytes`. A scene must survive being written and read again; an error must be one line.
/// True if `bytes` are a scene.
///
/// # Panics
/// If the property does not hold.
pub fn reads_or_refuses(bytes: &[u8]) -> bool {
    let scene = match Scene::read_nff(bytes, &LIMITS) {
        Ok(scene) => scene,
        Err(error) => {
            let sentence = error.to_string();
            assert!(!sentence.contains(char::is_control), "{sentence:?}");
            return false;
        }
    };
    // How the bytes arrive must not matter: one at a time is the hardest.
    let trickle = std::io::BufReader::with_capacity(1, bytes);
    assert_eq!(Scene::read_nff(trickle, &LIMITS).expect("same bytes"), scene);

    let mut writer = NffWriter::new(Vec::new()).number_format(NumberFormat::Shortest);
    scene.write_to(&mut writer).expect("what was read can be written");
    let text = writer.into_inner();
    // The text may hold one entity more than the limits allow: the default material.
    let again = Scene::read_nff(&text[..], &NffLimits::DEFAULT).expect("what was written is read");
    assert_eq!(again, scene, "{}", String::from_utf8_lossy(&text));
    true
}
