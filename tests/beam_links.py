"""Keys of link files of beams, as tests of all parts write them."""


def rectangle(height, width):
    return {"shape": "rectangle", "height": height, "width": width}


def tube(outer, inner):
    return {"shape": "tube", "outer": outer, "inner": inner}


def circle(diameter):
    return {"shape": "circle", "diameter": diameter}


def beam_link(length, section, elements, *, E=70e9, nu=0.33, rho=2700.0, condition="cantilever", **keys):
    """Of aluminum unless said otherwise; `nu`, `condition`: None leaves the key out; `keys` are those of the file."""
    material = {"youngs_modulus": E, "density": rho} | ({} if nu is None else {"poissons_ratio": nu})
    found = {"material": material, "geometry": {"kind": "beam", "length": length, "section": section}}
    found["mesh"] = {"elements": elements}
    if condition is not None:
        found["reference"] = {"condition": condition}
    return found | keys
