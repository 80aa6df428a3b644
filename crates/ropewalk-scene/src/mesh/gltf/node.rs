//! Lights and views at nodes, and what a file has besides.

use super::super::error::{Result, wrong};
use super::super::soup::Soup;
use super::{Matrix, Reader, array, entry, integer, part};
use crate::model::Camera;
use crate::stage::Light;
use serde_json::Value;
use std::f64::consts::FRAC_PI_4;

/// Pixels down a picture by a camera of a file, which says nothing of them.
const PICTURE_HEIGHT: u32 = 720;

/// Width over height where a camera says nothing.
const ASPECT: f64 = 16.0 / 9.0;

impl Reader<'_> {
    /// The light of a node (KHR_lights_punctual).
    pub(super) fn read_light(&mut self, node: &Value, matrix: &Matrix, name: &str) -> Result<()> {
        let key = "KHR_lights_punctual";
        let Some(index) = integer(&node["extensions"][key], "light", name)? else {
            return Ok(());
        };
        let light = entry(&self.json["extensions"][key], "lights", index, name)?;
        let name = format!("lights[{index}]");
        let number = |json: &Value, key: &str, default: f64| {
            json[key].as_f64().filter(|x| x.is_finite() && *x >= 0.0).unwrap_or(default)
        };
        let color = numbers::<3>(&light["color"]).unwrap_or([1.0; 3]);
        let power = number(light, "intensity", 1.0);
        let intensity = color.map(|x| (x.max(0.0) * power).min(f64::from(f32::MAX)) as f32);
        let (position, direction) = (position(matrix), direction(matrix, [0.0, 0.0, -1.0]));
        self.stage.lights.push(match (light["type"].as_str(), direction) {
            (Some("point"), _) => Light::Point { position, intensity },
            (Some("spot"), Some(direction)) => {
                let spot = &light["spot"];
                let outer = number(spot, "outerConeAngle", FRAC_PI_4).min(2.0 * FRAC_PI_4);
                let inner = number(spot, "innerConeAngle", 0.0).min(outer);
                Light::Spot { position, direction, intensity, cone: [inner as f32, outer as f32] }
            }
            (Some("directional"), Some(direction)) => {
                Light::Directional { direction, irradiance: intensity }
            }
            (Some("spot" | "directional"), None) => {
                self.soup.skip("lights without a direction");
                return Ok(());
            }
            (kind, _) => {
                let what = "point, spot or directional";
                return Err(wrong(part(format!("{name}.type")), what, kind.unwrap_or("none")));
            }
        });
        Ok(())
    }

    /// The camera of a node; the first one counts.
    pub(super) fn read_camera(&mut self, node: &Value, matrix: &Matrix, name: &str) -> Result<()> {
        let Some(index) = integer(node, "camera", name)? else {
            return Ok(());
        };
        let camera = entry(self.json, "cameras", index, &format!("{name}.camera"))?;
        if self.stage.camera.is_some() {
            self.soup.skip("cameras besides the first one");
            return Ok(());
        }
        let lens = &camera["perspective"];
        let (ahead, up) = (direction(matrix, [0.0, 0.0, -1.0]), direction(matrix, [0.0, 1.0, 0.0]));
        let (Some(yfov), Some(ahead), Some(up)) = (lens["yfov"].as_f64(), ahead, up) else {
            self.soup.skip("cameras without perspective or direction");
            return Ok(());
        };
        let aspect =
            lens["aspectRatio"].as_f64().filter(|a| (0.01..=100.0).contains(a)).unwrap_or(ASPECT);
        let angle = 2.0 * ((0.5 * yfov).tan() * aspect).atan().to_degrees();
        if !(angle > 0.0 && angle < 180.0 && yfov < std::f64::consts::PI) {
            let what = "an angle between 0 and pi";
            return Err(wrong(part(format!("cameras[{index}].perspective.yfov")), what, yfov));
        }
        let from = position(matrix);
        let width = (f64::from(PICTURE_HEIGHT) * aspect).round().max(1.0) as u32;
        self.stage.camera = Some(Camera {
            from,
            at: std::array::from_fn(|a| from[a] + ahead[a]),
            up,
            angle,
            hither: lens["znear"].as_f64().filter(|x| *x > 0.0 && x.is_finite()).unwrap_or(0.0),
            resolution: [width, PICTURE_HEIGHT],
        });
        Ok(())
    }
}

/// What is in the file and never read.
pub fn note_skipped(json: &Value, soup: &mut Soup) {
    for (key, what) in [
        ("animations", "animations: everything stands as its nodes say"),
        ("skins", "skins: meshes stand as they were bound"),
    ] {
        if !array(json, key).is_empty() {
            soup.skip(what);
        }
    }
    let scenes = array(json, "scenes").len();
    if scenes > 1 {
        soup.skip("scenes besides the default one");
    }
    let known = [
        "EXT_mesh_gpu_instancing",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_transmission",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
        // These have sentences of their own.
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_unlit",
    ];
    for extension in array(json, "extensionsUsed").iter().filter_map(Value::as_str) {
        if !known.contains(&extension) {
            soup.skip(format!("extension {extension}"));
        }
    }
}

/// So many finite numbers.
pub fn numbers<const N: usize>(json: &Value) -> Option<[f64; N]> {
    let all: Vec<f64> = json.as_array()?.iter().take(N + 1).filter_map(Value::as_f64).collect();
    all.try_into().ok()
}

fn position(matrix: &Matrix) -> [f64; 3] {
    matrix.map(|row| row[3])
}

/// The unit vector to which the matrix turns this one.
fn direction(matrix: &Matrix, v: [f64; 3]) -> Option<[f64; 3]> {
    let turned = matrix.map(|row| (0..3).map(|a| row[a] * v[a]).sum::<f64>());
    let length = turned.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length > 0.0 && length.is_finite()).then(|| turned.map(|x| x / length))
}
