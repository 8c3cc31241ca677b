//! A slot for a texture: which picture, by which coordinates, how tiled; and the pictures, each decoded once.
//!
//! Not here: what the slot means for the material (`material`), decoding (`texture`).

use twinray_scene::{TextureRef, TextureTransform, Wrap};

use super::json::Element;
use super::material::Reader;
use crate::error::FormatError;
use crate::reference::{data_uri, percent_decode};

impl Reader<'_, '_> {
    /// The texture of a slot. Whatever is wrong with it, the factor stands alone.
    pub(super) fn texture(&mut self, slot: Option<Element<'_>>) -> Option<TextureRef> {
        let slot = slot?;
        match self.try_texture(&slot) {
            Ok(texture) => texture,
            Err(error) => {
                self.context.warn(&slot.path, format!("{}: the factor is used alone", error.without_place()));
                None
            }
        }
    }

    fn try_texture(&mut self, slot: &Element<'_>) -> Result<Option<TextureRef>, FormatError> {
        let transform = slot.extension("KHR_texture_transform");
        let moved = transform.as_ref().map(|t| t.integer("texCoord")).transpose()?.flatten();
        let set = moved.or(slot.integer("texCoord")?).unwrap_or(0);
        let Some(set) = u8::try_from(set).ok().filter(|set| *set < 2) else {
            let message = format!("uses TEXCOORD_{set}; only 0 and 1 are read: the factor is used alone");
            self.context.warn(&slot.path, message);
            return Ok(None);
        };
        let transform = transform.as_ref().map(read_transform).transpose()?.unwrap_or_default();
        let link = slot.require("index", "the index of a texture")?;
        let (_, texture) = link.as_link(self.root, "textures")?;
        let webp = texture.extension("EXT_texture_webp");
        let source = webp.as_ref().filter(|w| w.get("source").is_some()).unwrap_or(&texture);
        let Some((index, image)) = source.follow("source", self.root, "images")? else {
            return Err(texture.fault("no source", "the index of an image"));
        };
        let Some(picture) = self.picture(index, &image) else { return Ok(None) };
        let sampler = texture.follow("sampler", self.root, "samplers")?.map(|(_, s)| s);
        let (mut wrap, mut nearest) = ([Wrap::Repeat; 2], false);
        if let Some(sampler) = sampler {
            wrap = [wrap_mode(&sampler, "wrapS"), wrap_mode(&sampler, "wrapT")];
            nearest = matches!(sampler.integer("magFilter"), Ok(Some(9728)));
        }
        Ok(Some(TextureRef { image: picture, wrap, nearest, set, transform }))
    }

    /// Our index of image `index` of the file, decoded when first asked for.
    fn picture(&mut self, index: usize, image: &Element<'_>) -> Option<usize> {
        if let Some(known) = self.materials.images.get(&index) {
            return *known;
        }
        let picture = match self.decode(index, image) {
            Ok((picture, remark)) => {
                remark.into_iter().for_each(|r| self.context.warn(&image.path, r));
                Some(picture)
            }
            Err(message) => {
                let message = format!("{message}: materials that use it keep their factor alone");
                self.context.warn(&image.path, message);
                None
            }
        };
        self.materials.images.insert(index, picture);
        picture
    }

    fn decode(&mut self, index: usize, image: &Element<'_>) -> Result<(usize, Option<String>), String> {
        let words = |error: FormatError| error.without_place();
        let (pictures, limits) = (&mut self.materials.pictures, self.context.limits);
        if let Some(view) = self.buffers.view(self.root, image).map_err(words)? {
            return pictures.add(&image.name_or(|| format!("image {index}")), view.bytes, limits);
        }
        let uri = image.text("uri").map_err(words)?.ok_or("has neither uri nor bufferView")?;
        match data_uri(uri) {
            Some(bytes) => pictures.add(&image.name_or(|| format!("image {index}")), &bytes?, limits),
            None => {
                let path = percent_decode(uri);
                let bytes = self.context.fetch(&image.path, &path).map_err(words)?;
                pictures.add(&path, &bytes, limits)
            }
        }
    }
}

fn read_transform(element: &Element<'_>) -> Result<TextureTransform, FormatError> {
    let none = TextureTransform::default();
    Ok(TextureTransform {
        offset: element.numbers("offset")?.unwrap_or(none.offset),
        rotation: element.number("rotation")?.unwrap_or(none.rotation),
        scale: element.numbers("scale")?.unwrap_or(none.scale),
    })
}

fn wrap_mode(sampler: &Element<'_>, key: &str) -> Wrap {
    match sampler.integer(key) {
        Ok(Some(33071)) => Wrap::Clamp,
        Ok(Some(33648)) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
