"""Tools from CAD: STEP, IGES and BREP files as trimmed NURBS surfaces that the solver reads."""
