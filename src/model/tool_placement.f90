!> Tools placed against the sheet: moved along a direction until their smallest distance to it is a
!! given clearance.
!!
!! The tool starts on the far side of the sheet and advances by its distance less the clearance,
!! which it can never overshoot, until nothing is left (J. C. Hart, The Visual Computer 12, 1996).
module tool_placement
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: to_text
  use knot_vector, only: span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use nurbs_solid, only: nurbs_solid_t, solid_face
  use tool, only: tool_t
  use closest_point, only: hit_t
  use tool_search, only: search_all_faces
  implicit none
  private

  public :: placing_shift, sheet_distance

  integer, parameter :: n_faces = 6
  integer, parameter :: n_parts = 4               !! samples of an element of a face, each way
  integer, parameter :: max_advances = 1000
  real(wp), parameter :: exact = 1.0e-12_wp       !! what is left, of the size of the scene

  !> A sample of the sheet: which face of which patch, and where on it.
  type :: sample_t
    integer :: face = 0
    real(wp) :: xi(2) = 0.0_wp, x(3) = 0.0_wp
    real(wp) :: bound = 0.0_wp                    !! its distance to the tool is at least this
  end type sample_t

contains

  !> Way of a tool along `direction` from where it is to where its smallest distance to the sheet is
  !! `clearance`, coming from behind. Refused: a tool that passes the sheet farther away.
  subroutine placing_shift(tool, solids, direction, clearance, shift, error)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)   !! patches of the sheet
    real(wp), intent(in) :: direction(3)           !! towards the sheet; not zero
    real(wp), intent(in) :: clearance              !! not negative [length]
    real(wp), intent(out) :: shift(3)              !! [length]
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t), allocatable :: faces(:)
    type(sample_t), allocatable :: samples(:)
    real(wp) :: unit(3), corners(3), way, last, size_of_all, nearest, least
    integer :: i

    unit = direction/norm2(direction)
    call sample_sheet(solids, faces, samples)
    ! The tool begins with its foremost corner behind the hindmost sample.
    corners = merge(tool%box(:, 2), tool%box(:, 1), unit > 0.0_wp)
    way = minval([(dot_product(samples(i)%x, unit), i=1, size(samples))]) &
          - dot_product(corners, unit) - clearance
    corners = merge(tool%box(:, 1), tool%box(:, 2), unit > 0.0_wp)
    last = maxval([(dot_product(samples(i)%x, unit), i=1, size(samples))]) &
           - dot_product(corners, unit) + clearance
    size_of_all = tool%scale + maxval([(maxval(abs(samples(i)%x)), i=1, size(samples))])
    least = huge(1.0_wp)
    do i = 1, max_advances
      nearest = distance_at(tool, faces, samples, way*unit)
      least = min(least, nearest)
      if (nearest - clearance <= exact*size_of_all .or. way > last) exit
      way = way + nearest - clearance
      samples%bound = samples%bound - (nearest - clearance)
    end do
    shift = way*unit
    if (nearest - clearance > 1000*exact*size_of_all) &
      call fail(error, "tool "//tool%name//" passes the sheet at a distance of "//to_text(least))
  end subroutine placing_shift

  !> Smallest distance between a tool where it is and the sheet.
  real(wp) function sheet_distance(tool, solids) result(distance)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)   !! patches of the sheet
    type(nurbs_surface_t), allocatable :: faces(:)
    type(sample_t), allocatable :: samples(:)

    call sample_sheet(solids, faces, samples)
    distance = distance_at(tool, faces, samples, [0.0_wp, 0.0_wp, 0.0_wp])
  end function sheet_distance

  !> Samples of all faces of all patches.
  subroutine sample_sheet(solids, faces, samples)
    type(nurbs_solid_t), intent(in) :: solids(:)
    type(nurbs_surface_t), allocatable, intent(out) :: faces(:)
    type(sample_t), allocatable, intent(out) :: samples(:)
    real(wp), allocatable :: xi(:), eta(:)
    integer :: p, f, i, j, n

    allocate (faces(n_faces*size(solids)))
    n = 0
    do p = 1, size(solids)
      do f = 1, n_faces
        faces(f + n_faces*(p - 1)) = solid_face(solids(p), f)
        associate (axes => faces(f + n_faces*(p - 1))%axes)
          n = n + (n_parts*size(span_table(axes(1))) + 1)*(n_parts*size(span_table(axes(2))) + 1)
        end associate
      end do
    end do
    allocate (samples(n))
    n = 0
    do f = 1, size(faces)
      xi = places_along(faces(f), 1)
      eta = places_along(faces(f), 2)
      do j = 1, size(eta)
        do i = 1, size(xi)
          n = n + 1
          samples(n)%face = f
          samples(n)%xi = [xi(i), eta(j)]
          call evaluate_surface(faces(f), samples(n)%xi, samples(n)%x)
        end do
      end do
    end do
  end subroutine sample_sheet

  !> Parameters of the samples along an axis of a face, ends included.
  pure function places_along(face, d) result(places)
    type(nurbs_surface_t), intent(in) :: face
    integer, intent(in) :: d
    real(wp), allocatable :: places(:)
    integer, allocatable :: spans(:)
    integer :: i, k

    spans = span_table(face%axes(d))
    associate (knots => face%axes(d)%knots)
      places = [((knots(spans(i)) + real(k, wp)/n_parts*(knots(spans(i) + 1) - knots(spans(i))), &
                  k=0, n_parts - 1), i=1, size(spans)), knots(size(knots))]
    end associate
  end function places_along

  !> Smallest distance between the sheet and the tool moved by `shift`. Samples whose bound is above
  !! it are left out, the nearest one is moved to where the sheet is nearest.
  real(wp) function distance_at(tool, faces, samples, shift) result(nearest)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: faces(:)
    type(sample_t), intent(inout) :: samples(:)
    real(wp), intent(in) :: shift(3)
    integer :: i, best

    best = minloc(samples%bound, 1)
    samples(best)%bound = distance_to(tool, samples(best)%x - shift)
    do i = 1, size(samples)
      if (samples(i)%bound > samples(best)%bound .or. i == best) cycle
      samples(i)%bound = distance_to(tool, samples(i)%x - shift)
      if (samples(i)%bound < samples(best)%bound) best = i
    end do
    nearest = descended(tool, faces(samples(best)%face), samples(best)%xi, shift)
  end function distance_at

  real(wp) function distance_to(tool, x)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t) :: hit

    call search_all_faces(tool, x, hit)
    distance_to = hit%distance
  end function distance_to

  !> Least distance to the tool that steps over a face come to: eight directions, then the bottom
  !! of the paraboloid through these places, then shorter steps.
  real(wp) function descended(tool, face, start, shift) result(least)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: face
    real(wp), intent(in) :: start(2), shift(3)
    real(wp), parameter :: shortest = 1.0e-8_wp, shorter = 0.2_wp
    real(wp) :: low(2), high(2), at(2), step(2), around(-1:1, -1:1), slope(2), bend(2), twist
    real(wp) :: trial(2), found, part
    integer :: i, j, d, best(2)

    do d = 1, 2
      associate (knots => face%axes(d)%knots)
        low(d) = knots(1)
        high(d) = knots(size(knots))
        step(d) = (high(d) - low(d))/(2*n_parts*size(span_table(face%axes(d))))
      end associate
    end do
    at = start
    part = 1.0_wp
    around(0, 0) = distance_from(at)
    do while (part > shortest)
      do j = -1, 1
        do i = -1, 1
          if (i /= 0 .or. j /= 0) around(i, j) = distance_from(at + part*step*[i, j])
        end do
      end do
      best = minloc(around) - 2
      if (around(best(1), best(2)) < around(0, 0)) then
        at = min(max(at + part*step*best, low), high)
        around(0, 0) = around(best(1), best(2))
        cycle
      end if
      slope = 0.5_wp*[around(1, 0) - around(-1, 0), around(0, 1) - around(0, -1)]
      bend = [around(1, 0) + around(-1, 0), around(0, 1) + around(0, -1)] - 2*around(0, 0)
      twist = 0.25_wp*(around(1, 1) + around(-1, -1) - around(1, -1) - around(-1, 1))
      trial = [twist*slope(2) - bend(2)*slope(1), twist*slope(1) - bend(1)*slope(2)] &
              /max(product(bend) - twist**2, tiny(1.0_wp))
      trial = min(max(at + part*step*min(max(trial, -1.0_wp), 1.0_wp), low), high)
      found = distance_from(trial)
      if (found < around(0, 0)) then
        at = trial
        around(0, 0) = found
      end if
      part = shorter*part
    end do
    least = around(0, 0)

  contains

    real(wp) function distance_from(xi)
      real(wp), intent(in) :: xi(2)
      real(wp) :: x(3)

      call evaluate_surface(face, min(max(xi, low), high), x)
      distance_from = distance_to(tool, x - shift)
    end function distance_from

  end function descended

end module tool_placement
