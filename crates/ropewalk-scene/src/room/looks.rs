//! What the room's surfaces are made of.

use super::pattern;
use crate::stage::{Image, Material, Texture, Wrap};

/// A material, by its place in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    Plaster,
    Ceiling,
    Floor,
    Trim,
    Oak,
    Walnut,
    Rug,
    Linen,
    Brass,
    Steel,
    Iron,
    Glass,
    White,
    Glazed,
    Clay,
    Soil,
    Leaf,
    Cloth,
    Shade,
    Bulb,
    Cover,
    Paper,
    Hills,
    Moons,
    Garden,
}

/// Images, by their place in the list.
const FLOOR: u32 = 0;
const WOOD: u32 = 1;
const RUG: u32 = 2;
const HILLS: u32 = 3;
const MOONS: u32 = 4;
const GLOW: u32 = 5;
const GARDEN: u32 = 6;

impl Look {
    /// All of them, in their order.
    const ALL: [Look; 25] = [
        Look::Plaster,
        Look::Ceiling,
        Look::Floor,
        Look::Trim,
        Look::Oak,
        Look::Walnut,
        Look::Rug,
        Look::Linen,
        Look::Brass,
        Look::Steel,
        Look::Iron,
        Look::Glass,
        Look::White,
        Look::Glazed,
        Look::Clay,
        Look::Soil,
        Look::Leaf,
        Look::Cloth,
        Look::Shade,
        Look::Bulb,
        Look::Cover,
        Look::Paper,
        Look::Hills,
        Look::Moons,
        Look::Garden,
    ];

    /// Metres that the image covers, each way.
    pub fn tile(self) -> f64 {
        match self {
            Look::Floor => 2.4,
            Look::Oak | Look::Walnut => 1.2,
            _ => 1.0,
        }
    }

    fn material(self) -> Material {
        let matte = |base_color| Material { base_color, ior: 1.0, ..Material::default() };
        let smooth =
            |base_color, roughness| Material { base_color, roughness, ..Material::default() };
        let metal =
            |base_color, roughness| Material { metallic: 1.0, ..smooth(base_color, roughness) };
        let wood = |base_color, roughness| shown(smooth(base_color, roughness), WOOD);
        let made = match self {
            Look::Plaster => matte([0.86, 0.82, 0.75]),
            Look::Ceiling => matte([0.88, 0.87, 0.85]),
            Look::Floor => shown(smooth([1.0; 3], 0.38), FLOOR),
            Look::Trim => smooth([0.85, 0.84, 0.81], 0.45),
            Look::Oak => wood([1.0; 3], 0.35),
            Look::Walnut => wood([0.42, 0.33, 0.28], 0.3),
            Look::Rug => shown(matte([1.0; 3]), RUG),
            Look::Linen => matte([0.86, 0.83, 0.76]),
            Look::Brass => metal([0.91, 0.72, 0.40], 0.25),
            Look::Steel => metal([0.75, 0.76, 0.78], 0.15),
            Look::Iron => smooth([0.03, 0.03, 0.035], 0.4),
            Look::Glass => {
                Material { transmission: 1.0, ior: 1.5, ..smooth([0.97, 0.99, 0.98], 0.0) }
            }
            Look::White => smooth([0.86, 0.85, 0.82], 0.08),
            Look::Glazed => smooth([0.06, 0.20, 0.32], 0.1),
            Look::Clay => smooth([0.62, 0.30, 0.17], 0.8),
            Look::Soil => matte([0.06, 0.045, 0.03]),
            Look::Leaf => smooth([0.10, 0.26, 0.07], 0.4),
            Look::Cloth => matte([1.0; 3]),
            Look::Shade => Material {
                emission: [1.5, 1.0, 0.55],
                emission_texture: Some(texture(GLOW, Wrap::Clamp)),
                ..matte([0.85, 0.80, 0.70])
            },
            Look::Bulb => Material { emission: [9.0, 6.6, 4.0], ..matte([0.8; 3]) },
            Look::Cover => smooth([1.0; 3], 0.55),
            Look::Paper => matte([0.84, 0.81, 0.74]),
            Look::Hills => shown(matte([1.0; 3]), HILLS),
            Look::Moons => shown(matte([1.0; 3]), MOONS),
            Look::Garden => Material {
                emission: [1.6; 3],
                emission_texture: Some(texture(GARDEN, Wrap::Clamp)),
                two_sided: false,
                ..matte([0.0; 3])
            },
        };
        Material { name: format!("{self:?}").to_lowercase(), ..made }
    }
}

fn texture(image: u32, wrap: Wrap) -> Texture {
    Texture { image, wrap: [wrap; 2] }
}

fn shown(material: Material, image: u32) -> Material {
    let base_color_texture = Some(texture(image, Wrap::Repeat));
    Material { base_color_texture, ..material }
}

/// The materials in the order of [`Look`].
pub fn materials() -> Vec<Material> {
    Look::ALL.map(Look::material).into()
}

/// The images that they name.
pub fn images() -> Vec<Image> {
    vec![
        pattern::planks(),
        pattern::wood(),
        pattern::rug(),
        pattern::hills(),
        pattern::moons(),
        pattern::glow(),
        pattern::garden(),
    ]
}
