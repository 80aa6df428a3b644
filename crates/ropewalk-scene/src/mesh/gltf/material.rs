//! Materials and their images.

use super::super::Watched;
use super::super::beside::Beside;
use super::super::error::{Result, wrong};
use super::super::picture::{Pictures, load};
use super::super::skipped::Skipped;
use super::buffer::{Buffers, decode_percent, fetch};
use super::node::numbers;
use super::{array, entry, integer, part};
use crate::stage::{Alpha, Material, Texture, Wrap};
use serde_json::Value;
use std::collections::HashMap;

/// Where images come from.
pub struct Source<'a> {
    pub json: &'a Value,
    pub buffers: &'a Buffers<'a>,
    pub beside: &'a Beside<'a>,
}

/// Which texture coordinates a material uses, and how they are moved (KHR_texture_transform). A stage has one pair a
/// corner: textures of one material that use others than the first are left out.
#[derive(Clone, Copy, PartialEq)]
pub struct Map {
    pub set: usize,
    /// Row by row.
    pub transform: [[f64; 3]; 2],
}

/// Materials that faces use, in the order of their first use.
#[derive(Default)]
pub struct Materials {
    used: Vec<Option<usize>>,
    /// Their places, with what their first texture uses.
    places: HashMap<Option<usize>, (u32, Map)>,
}

/// A texture as a material names it.
fn info<'a>(material: &'a Value, key: &str) -> Option<&'a Value> {
    let shine = &material["extensions"]["KHR_materials_pbrSpecularGlossiness"];
    let own = match key {
        "baseColorTexture" if shine["diffuseTexture"].is_object() => &shine["diffuseTexture"],
        "baseColorTexture" | "metallicRoughnessTexture" => &material["pbrMetallicRoughness"][key],
        _ => &material[key],
    };
    own.is_object().then_some(own)
}

const TEXTURES: [&str; 4] =
    ["baseColorTexture", "normalTexture", "metallicRoughnessTexture", "emissiveTexture"];

fn map_of(info: &Value) -> Map {
    let moved = &info["extensions"]["KHR_texture_transform"];
    let set = moved["texCoord"].as_u64().or(info["texCoord"].as_u64()).unwrap_or(0);
    let [x, y] = numbers::<2>(&moved["offset"]).unwrap_or([0.0; 2]);
    let [sx, sy] = numbers::<2>(&moved["scale"]).unwrap_or([1.0; 2]);
    let (sin, cos) = moved["rotation"].as_f64().unwrap_or(0.0).sin_cos();
    let transform = [[sx * cos, sy * sin, x], [-sx * sin, sy * cos, y]];
    Map { set: set.min(1 << 20) as usize, transform }
}

impl Materials {
    /// The place of a primitive's material, and the texture coordinates that it wants.
    pub fn of_primitive(
        &mut self,
        json: &Value,
        index: Option<usize>,
        name: &str,
    ) -> Result<(u32, Map)> {
        if let Some(&known) = self.places.get(&index) {
            return Ok(known);
        }
        let plain = Map { set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
        let map = match index {
            None => plain,
            Some(index) => {
                let material = entry(json, "materials", index, &format!("{name}.material"))?;
                TEXTURES.iter().find_map(|key| info(material, key)).map_or(plain, map_of)
            }
        };
        let place = (self.used.len() as u32, map);
        self.used.push(index);
        self.places.insert(index, place);
        Ok(place)
    }

    /// All of them, with their images.
    pub fn read(
        &self,
        source: &Source<'_>,
        pictures: &mut Pictures,
        skipped: &mut Skipped,
        limits: &Watched<'_>,
    ) -> Result<Vec<Material>> {
        let one = |index: &Option<usize>| match index {
            // Deviation: glTF's default material is white metal, which shows nothing of a plain mesh.
            None => Ok(Material::default()),
            Some(index) => {
                let json = &source.json["materials"][*index];
                let mut material = plain(json, &format!("materials[{index}]"), skipped)?;
                let map = self.places.get(&Some(*index)).map(|known| known.1);
                for key in TEXTURES {
                    let Some(info) = info(json, key) else {
                        continue;
                    };
                    if Some(map_of(info)) != map {
                        skipped.note(
                            "textures with other coordinates than the first of their material",
                        );
                        continue;
                    }
                    let texture = texture(info, source, pictures, skipped, limits)?;
                    match key {
                        "baseColorTexture" => material.base_color_texture = texture,
                        "normalTexture" => material.normal_texture = texture,
                        "metallicRoughnessTexture" => material.metallic_roughness_texture = texture,
                        _ => material.emission_texture = texture,
                    }
                }
                Ok(material)
            }
        };
        self.used.iter().map(one).collect()
    }
}

/// A material without its textures.
fn plain(json: &Value, name: &str, skipped: &mut Skipped) -> Result<Material> {
    let pbr = &json["pbrMetallicRoughness"];
    let share = |json: &Value, key: &str, default: f32| -> Result<f32> {
        let value = &json[key];
        if value.is_null() {
            return Ok(default);
        }
        let found = value.as_f64().filter(|x| x.is_finite()).map(|x| x.clamp(0.0, 1.0) as f32);
        found.ok_or_else(|| wrong(part(format!("{name}.{key}")), "a number from 0 to 1", value))
    };
    let clamped = |color: [f64; 4]| color.map(|x| x.clamp(0.0, 1.0) as f32);
    let mut color = clamped(numbers::<4>(&pbr["baseColorFactor"]).unwrap_or([1.0; 4]));
    let mut metallic = share(pbr, "metallicFactor", 1.0)?;
    let mut roughness = share(pbr, "roughnessFactor", 1.0)?;
    let extensions = &json["extensions"];
    let shine = &extensions["KHR_materials_pbrSpecularGlossiness"];
    if shine.is_object() {
        color = clamped(numbers::<4>(&shine["diffuseFactor"]).unwrap_or([1.0; 4]));
        (metallic, roughness) = (0.0, 1.0 - share(shine, "glossinessFactor", 1.0)?);
        skipped.note("specular colours of KHR_materials_pbrSpecularGlossiness");
    }
    if extensions["KHR_materials_unlit"].is_object() {
        (metallic, roughness) = (0.0, 1.0);
        skipped.note("KHR_materials_unlit: such materials are matte");
    }
    let strength = &extensions["KHR_materials_emissive_strength"]["emissiveStrength"];
    let strength = strength.as_f64().filter(|x| *x >= 0.0 && x.is_finite()).unwrap_or(1.0);
    let emission = numbers::<3>(&json["emissiveFactor"]).unwrap_or([0.0; 3]);
    let emission = emission.map(|x| (x.max(0.0) * strength).min(f64::from(f32::MAX)) as f32);
    let ior = extensions["KHR_materials_ior"]["ior"].as_f64().filter(|x| *x >= 1.0 && *x < 1e3);
    let alpha = match json["alphaMode"].as_str().unwrap_or("OPAQUE") {
        "OPAQUE" => Alpha::Opaque,
        "MASK" => Alpha::Mask(share(json, "alphaCutoff", 0.5)?),
        "BLEND" => Alpha::Blend,
        other => {
            let what = "OPAQUE, MASK or BLEND";
            return Err(wrong(part(format!("{name}.alphaMode")), what, other));
        }
    };
    let transmission = &extensions["KHR_materials_transmission"];
    if json["occlusionTexture"].is_object() {
        skipped.note("occlusion textures, since light is followed instead");
    }
    if transmission["transmissionTexture"].is_object() {
        skipped.note("transmission textures");
    }
    let scale = json["normalTexture"]["scale"].as_f64().unwrap_or(1.0);
    if scale != 1.0 {
        skipped.note("scales of normal textures");
    }
    Ok(Material {
        name: json["name"].as_str().unwrap_or_default().to_owned(),
        base_color: [color[0], color[1], color[2]],
        opacity: color[3],
        alpha,
        metallic,
        roughness,
        emission,
        transmission: share(transmission, "transmissionFactor", 0.0)?,
        ior: ior.unwrap_or(1.5) as f32,
        two_sided: json["doubleSided"].as_bool().unwrap_or(false),
        ..Material::default()
    })
}

/// A texture with its image; `None` if the image cannot be had.
fn texture(
    info: &Value,
    source: &Source<'_>,
    pictures: &mut Pictures,
    skipped: &mut Skipped,
    limits: &Watched<'_>,
) -> Result<Option<Texture>> {
    let json = source.json;
    let Some(index) = integer(info, "index", "textureInfo")? else {
        skipped.note("textures without an index");
        return Ok(None);
    };
    let texture = entry(json, "textures", index, "textureInfo.index")?;
    let name = format!("textures[{index}]");
    let webp = integer(&texture["extensions"]["EXT_texture_webp"], "source", &name)?;
    let Some(image) =
        webp.map_or_else(|| integer(texture, "source", &name), |webp| Ok(Some(webp)))?
    else {
        skipped.note(format!("{name}: expected a PNG, JPEG or WebP source, found none"));
        return Ok(None);
    };
    let picture = entry(json, "images", image, &format!("{name}.source"))?;
    let load = || match picture["uri"].as_str() {
        Some(uri) if !uri.starts_with("data:") => load(source.beside, &decode_percent(uri)),
        Some(uri) => fetch(uri, 0, source.beside).map_err(|(expected, found)| {
            // Data may be long.
            let found: String = found.chars().take(80).collect();
            format!("expected {expected}, found {found}")
        }),
        None => view(picture, source).map(<[u8]>::to_vec),
    };
    let shown = match picture["uri"].as_str().filter(|uri| !uri.starts_with("data:")) {
        Some(uri) => uri.to_owned(),
        None => format!("images[{image}]"),
    };
    let Some(image) = pictures.get(&shown, load, skipped, limits)? else {
        return Ok(None);
    };
    let sampler = match integer(texture, "sampler", &name)? {
        Some(sampler) => entry(json, "samplers", sampler, &format!("{name}.sampler"))?,
        None => &Value::Null,
    };
    let wrap = |key: &str| match sampler[key].as_u64() {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    Ok(Some(Texture { image, wrap: [wrap("wrapS"), wrap("wrapT")] }))
}

/// The bytes of an image in a buffer.
fn view<'a>(picture: &Value, source: &'a Source<'_>) -> std::result::Result<&'a [u8], String> {
    let index = picture["bufferView"].as_u64().and_then(|x| usize::try_from(x).ok());
    let json = index.and_then(|index| array(source.json, "bufferViews").get(index));
    let bytes = json.and_then(|json| source.buffers.view(json, "bufferView").ok());
    bytes.ok_or_else(|| "expected a uri or bytes of a buffer, found neither".to_owned())
}
