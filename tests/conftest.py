import pytest


def pytest_collection_modifyitems(config, items):
    """Leave out what is slow unless it is asked for: python -m pytest -m slow."""
    if "slow" not in config.option.markexpr:
        for item in items:
            if item.get_closest_marker("slow"):
                item.add_marker(pytest.mark.skip(reason="takes minutes; ask for it with -m slow"))
    if not config.option.markexpr and not any("::" in name or name.endswith(".py") for name in config.args):
        kept = [item for item in items if not item.get_closest_marker("thorough")]
        config.hook.pytest_deselected(items=[item for item in items if item not in set(kept)])
        items[:] = kept
