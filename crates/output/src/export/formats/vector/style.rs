//! QGIS styles of layers, which look like terrane's topographic maps as far as the symbols of QGIS allow.
//!
//! Based on: the documents that QGIS 3.22 writes. QGIS fills in elements that are left out here. A symbol is a list of
//! layers, drawn one on top of the other.

use std::fmt::Write;

use crate::export::formats::svg::escaped;
use crate::features::layer::GeometryType;
use crate::map::font::Face;
use crate::map::style::{Colour, LabelStyle, Style};

/// Millimetres in a point of type.
const MM_A_POINT: f64 = 25.4 / 72.0;

/// The style of a layer.
pub(crate) struct LayerStyle {
    /// The element that draws the features.
    pub renderer: String,
    /// The element that labels the features, if they have labels.
    pub labels: Option<String>,
}

impl LayerStyle {
    /// Returns the document of the style.
    pub fn document(&self) -> String {
        let labels = self.labels.as_deref().unwrap_or_default();
        format!(
            "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n\
             <qgis version=\"3.22.0\" styleCategories=\"Symbology|Labeling\" labelsEnabled=\"{}\">\n{}{labels}</qgis>\n",
            u8::from(self.labels.is_some()),
            self.renderer
        )
    }
}

/// Returns the style of the layer with this name, if maps show such a layer.
pub(crate) fn of_layer(name: &str, shape: GeometryType) -> Option<LayerStyle> {
    let style = Style::load("topographic").expect("the built-in styles are good");
    let (water, roads, places, labels) = (&style.water, &style.roads, &style.places, &style.labels);
    // The width on the ground, or the width of a line on paper where this is more.
    let width = |least: f64, most: f64, width_m: &str| {
        format!(
            "max(scale_exp(coalesce({width_m}, 0), 0, 60, {least}, {most}, 0.6), coalesce({width_m}, 0) / @map_scale * 1000)"
        )
    };
    let (renderer, labels) = match name {
        // Rivers of agents and of fluvial land. Only the latter have names.
        "rivers" => {
            let wide = width(water.river_mm[0], water.river_mm[1], "(\"width_start_m\" + \"width_end_m\") / 2");
            let symbol = line(&Stroke { wide: Some(wide), ..Stroke::new(water.line, water.river_mm[0]) });
            let name = (shape == GeometryType::LineZ)
                .then(|| written("\"name\"", &labels.river, LabelPlacement::Line, &style));
            (single("line", &symbol), name)
        }
        "lakes" => {
            let symbol = filled(Some(water.fill), Some(&Stroke::new(water.line, water.shore_mm)));
            (single("fill", &symbol), Some(written("\"name\"", &labels.lake, LabelPlacement::Middle, &style)))
        }
        "coast" => (single("line", &line(&Stroke::new(water.line, water.shore_mm))), None),
        "contours" => {
            let contours = &style.contours;
            let stroke = |colour: Colour, width_mm: f64| {
                line(&Stroke { opacity: contours.opacity, ..Stroke::new(colour, width_mm) })
            };
            let (thin, thick) = (contours.width_mm, contours.index_width_mm);
            let rules = [
                ("\"kind\" = 'land' AND \"is_index\" = 0", "land", stroke(contours.colour, thin)),
                ("\"kind\" = 'land' AND \"is_index\" = 1", "land, each fifth", stroke(contours.colour, thick)),
                ("\"kind\" = 'depth'", "depth", stroke(water.line, water.depth_mm)),
            ];
            let height = "if(\"is_index\" = 1, round(\"height_m\", 2), NULL)";
            (ruled("line", &rules), Some(written(height, &labels.contour, LabelPlacement::Line, &style)))
        }
        "roads" => {
            // The best class comes last, so that it lies on top of the others.
            let classes = ["track", "road", "highway"].into_iter().zip(roads.classes.iter().rev());
            let rules: Vec<(String, &str, String)> = classes
                .map(|(class, road)| {
                    let casing = Stroke::new(roads.casing, road.width_mm + 2.0 * road.casing_mm);
                    let symbol = line(&casing) + &line(&Stroke::new(road.colour, road.width_mm));
                    (format!("\"class\" = '{class}'"), class, symbol)
                })
                .collect();
            match shape {
                GeometryType::LineZ => (ruled("line", &rules), None),
                // Roads of agents have no classes.
                _ => (single("line", &rules[1].2), None),
            }
        }
        "crossings" => (single("marker", &marker("circle", places.fill, places.colour, 0.9)), None),
        "peaks" => {
            let name = "concat(coalesce(\"name\" || '\\n', ''), round(\"height_m\"))";
            let symbol = marker("triangle", places.colour, places.colour, 1.4);
            (single("marker", &symbol), Some(written(name, &labels.peak, LabelPlacement::Point, &style)))
        }
        "sites" => {
            let sizes = [("hamlet", 1.1), ("village", 1.6), ("town", 2.2)];
            let rules = sizes.map(|(class, mm)| {
                (format!("\"class\" = '{class}'"), class, marker("circle", places.fill, places.colour, mm))
            });
            let name = written("\"name\"", &labels.places[1], LabelPlacement::Point, &style);
            (ruled("marker", &rules), Some(name))
        }
        "tiles" => {
            let stroke = Stroke { dashed: true, ..Stroke::new(style.ink, 0.1) };
            (single("fill", &filled(None, Some(&stroke))), None)
        }
        _ => return None,
    };
    Some(LayerStyle { renderer, labels })
}

/// A stroke of a symbol.
struct Stroke {
    colour: Colour,
    width_mm: f64,
    opacity: f64,
    dashed: bool,
    /// Expression for the width in millimetres, used instead of `width_mm`.
    wide: Option<String>,
}

impl Stroke {
    fn new(colour: Colour, width_mm: f64) -> Stroke {
        Stroke { colour, width_mm, opacity: 1.0, dashed: false, wide: None }
    }
}

fn rgba(Colour([red, green, blue]): Colour, opacity: f64) -> String {
    format!("{red},{green},{blue},{}", (opacity * 255.0).round())
}

/// Returns a layer of a symbol: its class, its options, and an expression that sets one of its properties.
fn layer(class: &str, options: &[(&str, String)], expression: Option<(&str, &str)>) -> String {
    let mut text = format!("<layer class=\"{class}\" enabled=\"1\" pass=\"0\" locked=\"0\"><Option type=\"Map\">");
    let put = |text: &mut String, name: &str, value: &str, kind: &str| {
        _ = write!(text, "<Option name=\"{name}\" value=\"{}\" type=\"{kind}\"/>", escaped(value));
    };
    for (name, value) in options {
        put(&mut text, name, value, "QString");
    }
    text.push_str("</Option>");
    if let Some((property, expression)) = expression {
        text.push_str("<data_defined_properties><Option type=\"Map\">");
        put(&mut text, "name", "", "QString");
        _ = write!(text, "<Option name=\"properties\" type=\"Map\"><Option name=\"{property}\" type=\"Map\">");
        put(&mut text, "active", "true", "bool");
        put(&mut text, "expression", expression, "QString");
        // Type 3 is an expression.
        put(&mut text, "type", "3", "int");
        text.push_str("</Option></Option>");
        put(&mut text, "type", "collection", "QString");
        text.push_str("</Option></data_defined_properties>");
    }
    text + "</layer>"
}

fn line(stroke: &Stroke) -> String {
    let options = [
        ("line_color", rgba(stroke.colour, stroke.opacity)),
        ("line_width", stroke.width_mm.to_string()),
        ("line_width_unit", "MM".into()),
        ("line_style", if stroke.dashed { "dash" } else { "solid" }.into()),
        ("capstyle", "round".into()),
        ("joinstyle", "round".into()),
    ];
    layer("SimpleLine", &options, stroke.wide.as_deref().map(|expression| ("outlineWidth", expression)))
}

fn filled(fill: Option<Colour>, stroke: Option<&Stroke>) -> String {
    let none = Stroke::new(Colour([0; 3]), 0.0);
    let outline = stroke.unwrap_or(&none);
    let style = match (stroke, outline.dashed) {
        (None, _) => "no",
        (_, true) => "dash",
        (_, false) => "solid",
    };
    let options = [
        ("color", rgba(fill.unwrap_or(Colour([0; 3])), 1.0)),
        ("style", if fill.is_some() { "solid" } else { "no" }.into()),
        ("outline_color", rgba(outline.colour, outline.opacity)),
        ("outline_width", outline.width_mm.to_string()),
        ("outline_width_unit", "MM".into()),
        ("outline_style", style.into()),
        ("joinstyle", "round".into()),
    ];
    layer("SimpleFill", &options, None)
}

fn marker(name: &str, fill: Colour, outline: Colour, size_mm: f64) -> String {
    let options = [
        ("name", name.to_owned()),
        ("color", rgba(fill, 1.0)),
        ("outline_color", rgba(outline, 1.0)),
        ("outline_width", "0.2".into()),
        ("outline_width_unit", "MM".into()),
        ("size", size_mm.to_string()),
        ("size_unit", "MM".into()),
    ];
    layer("SimpleMarker", &options, None)
}

fn symbol(kind: &str, number: usize, layers: &str) -> String {
    format!(
        "<symbol type=\"{kind}\" name=\"{number}\" alpha=\"1\" clip_to_extent=\"1\" force_rhr=\"0\">{layers}</symbol>\n"
    )
}

/// Returns a renderer that draws all features alike.
fn single(kind: &str, layers: &str) -> String {
    format!(
        "<renderer-v2 type=\"singleSymbol\" symbollevels=\"0\" forceraster=\"0\" enableorderby=\"0\">\n<symbols>{}</symbols>\n\
         </renderer-v2>\n",
        symbol(kind, 0, layers)
    )
}

/// Returns a renderer with rules, each an expression, a text for the legend, and the layers of the symbol. Features of
/// the last rule lie on top.
fn ruled(kind: &str, rules: &[(impl AsRef<str>, &str, String)]) -> String {
    let mut text =
        "<renderer-v2 type=\"RuleRenderer\" symbollevels=\"1\" forceraster=\"0\" enableorderby=\"0\">\n".to_owned();
    text.push_str("<rules key=\"{00000000-0000-4000-8000-000000000000}\">\n");
    for (number, (filter, label, _)) in rules.iter().enumerate() {
        _ = writeln!(
            text,
            "<rule key=\"{{00000000-0000-4000-8000-{:012}}}\" symbol=\"{number}\" filter=\"{}\" label=\"{label}\"/>",
            number + 1,
            escaped(filter.as_ref())
        );
    }
    text.push_str("</rules>\n<symbols>\n");
    for (number, (_, _, layers)) in rules.iter().enumerate() {
        // Passes keep the casings of one class off the fill of another.
        let pass = format!("pass=\"{number}\"");
        text.push_str(&symbol(kind, number, &layers.replace("pass=\"0\"", &pass)));
    }
    text + "</symbols>\n</renderer-v2>\n"
}

/// Placement of labels.
#[derive(Clone, Copy, PartialEq)]
enum LabelPlacement {
    /// Curved along a line.
    Line,
    /// Within a polygon.
    Middle,
    /// Beside a point.
    Point,
}

/// Returns the element that labels features. The text is an expression.
fn written(text: &str, label: &LabelStyle, along: LabelPlacement, style: &Style) -> String {
    let placement = match along {
        // Placement numbers of QGIS: curved (3), horizontal (4), around a point in the order that maps prefer (6).
        LabelPlacement::Line => {
            "placement=\"3\" placementFlags=\"9\" maxCurvedCharAngleIn=\"25\" maxCurvedCharAngleOut=\"-25\""
        }
        LabelPlacement::Middle => "placement=\"4\"",
        LabelPlacement::Point => {
            "placement=\"6\" dist=\"0.6\" distUnits=\"MM\" predefinedPositionOrder=\"TR,BR,TL,BL,R,L,TSR,BSR\""
        }
    };
    let italic = u8::from(matches!(label.face, Face::Italic | Face::SemiboldItalic | Face::BoldItalic));
    // Font weights on a scale of a hundred, as in Qt, the library that QGIS is built with.
    let weight = match label.face {
        Face::Regular | Face::Italic => 50,
        Face::Semibold | Face::SemiboldItalic => 63,
        Face::Bold | Face::BoldItalic => 75,
    };
    let halo = &style.labels;
    format!(
        "<labeling type=\"simple\"><settings calloutType=\"simple\">\n\
         <text-style fieldName=\"{}\" isExpression=\"1\" fontFamily=\"Noto Sans\" fontSize=\"{:.1}\" fontSizeUnit=\"Point\" \
         fontItalic=\"{italic}\" fontWeight=\"{weight}\" textColor=\"{}\" textOpacity=\"1\" multilineHeight=\"1\">\
         <text-buffer bufferDraw=\"1\" bufferSize=\"{}\" bufferSizeUnits=\"MM\" bufferColor=\"{}\" bufferOpacity=\"0.8\" \
         bufferJoinStyle=\"128\"/></text-style>\n\
         <text-format multilineAlign=\"3\" autoWrapLength=\"0\"/>\n<placement {placement}/>\n\
         <rendering displayAll=\"0\" mergeLines=\"{}\" obstacle=\"0\" minFeatureSize=\"0\"/>\n</settings></labeling>\n",
        escaped(text),
        // The size of a face is the height of a line.
        label.size_mm / MM_A_POINT,
        rgba(label.colour, 1.0),
        halo.halo_mm * 2.0,
        rgba(halo.halo, 1.0),
        u8::from(along == LabelPlacement::Line),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::layers;
    use crate::preset::Preset;
    use crate::world::World;

    #[test]
    fn all_layers_have_a_style() {
        for name in ["alps", "thesis"] {
            let world = World::new(Preset::load(name).unwrap().1, None).unwrap();
            for layer in layers(&world) {
                let style = of_layer(layer.name(), layer.shape()).unwrap_or_else(|| panic!("{}", layer.name()));
                let document = style.document();
                for (open, close) in [("<layer ", "</layer>"), ("<symbol ", "</symbol>"), ("<labeling ", "</labeling>")]
                {
                    assert_eq!(document.matches(open).count(), document.matches(close).count(), "{}", layer.name());
                }
            }
        }
        assert!(of_layer("nothing", GeometryType::Point).is_none());
    }
}
