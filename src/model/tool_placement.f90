!> Tools placed against the sheet: moved along a direction until their smallest distance to it is a
!! given clearance.
!!
!! The tool starts on the far side of the sheet and advances by its distance less the clearance,
!! which it can never overshoot, until nothing is left (J. C. Hart, The Visual Computer 12, 1996).
!! The distance is sought by descents from samples of the sheet. Should they have missed a place, a
!! look between the samples at the end finds it, and the tool goes back.
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
  integer, parameter :: n_descents = 4            !! from the nearest samples
  integer, parameter :: max_advances = 1000
  real(wp), parameter :: exact = 1.0e-12_wp       !! what is left, of the size of the scene

  !> A sample of the sheet: which face of which patch, and where on it.
  type :: sample_t
    integer :: face = 0
    real(wp) :: xi(2) = 0.0_wp, x(3) = 0.0_wp
    real(wp) :: half(2) = 0.0_wp                  !! way half to the next samples along xi, eta
    real(wp) :: reach = 0.0_wp                    !! and to the middle between four, amply [length]
    real(wp) :: bound = 0.0_wp                    !! its distance to the tool is at least this
  end type sample_t

contains

  !> Way of a tool along `direction` from where it is to where its smallest distance to the sheet is
  !! `clearance`, coming from behind. Refused: a tool that passes the sheet farther away, and one
  !! that comes to no end.
  subroutine placing_shift(tool, solids, direction, clearance, shift, error)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)   !! patches of the sheet
    real(wp), intent(in) :: direction(3)           !! towards the sheet; not zero
    real(wp), intent(in) :: clearance              !! not negative [length]
    real(wp), intent(out) :: shift(3)              !! [length]
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t), allocatable :: faces(:)
    type(sample_t), allocatable :: samples(:)
    real(wp) :: unit(3), corners(3), way, last, enough, nearest, least
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
    enough = exact*(tool%scale + maxval([(maxval(abs(samples(i)%x)), i=1, size(samples))]))
    least = huge(1.0_wp)
    do i = 1, max_advances
      nearest = distance_at(tool, faces, samples, way*unit)
      if (abs(nearest - clearance) <= enough) call look_between(tool, faces, samples, way*unit, &
                                                                nearest)
      least = min(least, nearest)
      if (abs(nearest - clearance) <= enough .or. way > last) exit
      way = way + nearest - clearance
      samples%bound = samples%bound - abs(nearest - clearance)
    end do
    shift = way*unit
    if (abs(nearest - clearance) <= 1000*enough) return
    if (way > last) then
      call fail(error, "tool "//tool%name//" passes the sheet at a distance of "//to_text(least))
    else
      call fail(error, "tool "//tool%name//" does not come to rest at its clearance from the "// &
                "sheet; the last distance is "//to_text(nearest))
    end if
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
    integer :: p, f

    allocate (faces(n_faces*size(solids)), samples(0))
    do p = 1, size(solids)
      do f = 1, n_faces
        faces(f + n_faces*(p - 1)) = solid_face(solids(p), f)
      end do
    end do
    do f = 1, size(faces)
      samples = [samples, samples_of(faces(f), f)]
    end do
  end subroutine sample_sheet

  !> Samples of a face.
  function samples_of(face, number) result(samples)
    type(nurbs_surface_t), intent(in) :: face
    integer, intent(in) :: number
    type(sample_t), allocatable :: samples(:)
    real(wp), parameter :: ample = 1.2_wp     ! for the bend between samples
    real(wp), allocatable :: xi(:), eta(:), x(:, :, :), sides(:, :)
    integer :: i, j, n

    xi = places_along(face, 1)
    eta = places_along(face, 2)
    allocate (samples(size(xi)*size(eta)), x(3, 0:size(xi) + 1, 0:size(eta) + 1), sides(3, 4))
    do j = 1, size(eta)
      do i = 1, size(xi)
        call evaluate_surface(face, [xi(i), eta(j)], x(:, i, j))
      end do
    end do
    x(:, 0, :) = x(:, 2, :)
    x(:, size(xi) + 1, :) = x(:, size(xi) - 1, :)
    x(:, :, 0) = x(:, :, 2)
    x(:, :, size(eta) + 1) = x(:, :, size(eta) - 1)
    n = 0
    do j = 1, size(eta)
      do i = 1, size(xi)
        n = n + 1
        samples(n)%face = number
        samples(n)%xi = [xi(i), eta(j)]
        samples(n)%x = x(:, i, j)
        samples(n)%half = 0.5_wp*[widest(xi, i), widest(eta, j)]
        sides = reshape([x(:, i - 1, j), x(:, i + 1, j), x(:, i, j - 1), x(:, i, j + 1)], [3, 4]) &
                - spread(x(:, i, j), 2, 4)
        samples(n)%reach = 0.5_wp*ample*(maxval(norm2(sides(:, :2), 1)) &
                                         + maxval(norm2(sides(:, 3:), 1)))
      end do
    end do
  end function samples_of

  !> The wider of the steps to either side of a place.
  pure real(wp) function widest(places, i)
    real(wp), intent(in) :: places(:)
    integer, intent(in) :: i

    widest = max(places(i) - places(max(i - 1, 1)), places(min(i + 1, size(places))) - places(i))
  end function widest

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
  !! it are left out; the few nearest of different places are moved to where the sheet is nearest.
  real(wp) function distance_at(tool, faces, samples, shift) result(nearest)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: faces(:)
    type(sample_t), intent(inout) :: samples(:)
    real(wp), intent(in) :: shift(3)
    real(wp), parameter :: coarse = 0.01_wp, fine = 1.0e-8_wp   ! last steps, of the first
    logical :: is_open(size(samples))      ! may lead to a place that no descent has led to
    real(wp) :: at(2), lowest(2), found
    integer :: i, best, n, face

    best = minloc(samples%bound, 1)
    samples(best)%bound = distance_to(tool, samples(best)%x - shift)
    do i = 1, size(samples)
      if (samples(i)%bound > samples(best)%bound .or. i == best) cycle
      samples(i)%bound = distance_to(tool, samples(i)%x - shift)
      if (samples(i)%bound < samples(best)%bound) best = i
    end do
    nearest = huge(1.0_wp)
    is_open = .true.
    do n = 1, n_descents
      at = samples(best)%xi
      call go_down(tool, faces(samples(best)%face), shift, coarse, at, found)
      if (found < nearest) then
        nearest = found
        lowest = at
        face = samples(best)%face
      end if
      is_open = is_open .and. samples%bound - samples%reach < nearest .and. &
                [(norm2(samples(i)%x - samples(best)%x) > 2*samples(i)%reach, i=1, size(samples))]
      call find_next(tool, samples, is_open, shift, best)
      if (best == 0) exit
    end do
    call go_down(tool, faces(face), shift, fine, lowest, nearest)
  end function distance_at

  !> Nearest of some samples; 0: there is none.
  subroutine find_next(tool, samples, is_open, shift, best)
    type(tool_t), intent(in) :: tool
    type(sample_t), intent(inout) :: samples(:)
    logical, intent(in) :: is_open(:)
    real(wp), intent(in) :: shift(3)
    integer, intent(out) :: best
    integer :: i

    best = 0
    do i = 1, size(samples)
      if (.not. is_open(i)) cycle
      if (best > 0) then
        if (samples(i)%bound >= samples(best)%bound) cycle
      end if
      samples(i)%bound = distance_to(tool, samples(i)%x - shift)
      if (best > 0) then
        if (samples(i)%bound >= samples(best)%bound) cycle
      end if
      best = i
    end do
  end subroutine find_next

  !> Descents from the middles between samples that may hide a nearer place. If there is one, these
  !! middles become samples.
  subroutine look_between(tool, faces, samples, shift, nearest)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: faces(:)
    type(sample_t), allocatable, intent(inout) :: samples(:)
    real(wp), intent(in) :: shift(3)
    real(wp), intent(inout) :: nearest       !! as far as it is known [length]
    type(sample_t), allocatable :: middles(:)
    real(wp) :: found
    integer :: i, corner, n

    allocate (middles(4*count(samples%bound - samples%reach < nearest)))
    n = 0
    do i = 1, size(samples)
      if (samples(i)%bound - samples(i)%reach >= nearest) cycle
      do corner = 0, 3
        associate (middle => middles(n + 1), axes => faces(samples(i)%face)%axes)
          middle = samples(i)
          middle%xi = middle%xi + middle%half*merge(1, -1, [btest(corner, 0), btest(corner, 1)])
          if (any(middle%xi < [axes(1)%knots(1), axes(2)%knots(1)]) .or. &
              any(middle%xi > [maxval(axes(1)%knots), maxval(axes(2)%knots)])) cycle
          middle%bound = middle%bound - middle%reach
          middle%half = 0.5_wp*middle%half
          middle%reach = 0.5_wp*middle%reach
          call evaluate_surface(faces(middle%face), middle%xi, middle%x)
          n = n + 1
        end associate
      end do
    end do
    if (n == 0) return
    middles = middles(:n)
    found = distance_at(tool, faces, middles, shift)
    if (found >= nearest) return
    nearest = found
    samples = [samples, pack(middles, middles%bound - middles%reach < nearest)]
  end subroutine look_between

  real(wp) function distance_to(tool, x)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(3)
    type(hit_t) :: hit

    call search_all_faces(tool, x, hit)
    distance_to = hit%distance
  end function distance_to

  !> Steps over a face to the least distance to the tool that they come to: eight directions, then
  !! the bottom of the paraboloid through these places, then shorter steps.
  subroutine go_down(tool, face, shift, shortest, at, least)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: face
    real(wp), intent(in) :: shift(3)
    real(wp), intent(in) :: shortest         !! step, part of the first one
    real(wp), intent(inout) :: at(2)         !! where to start, then where it ended
    real(wp), intent(out) :: least           !! [length]
    real(wp), parameter :: shorter = 0.2_wp
    real(wp) :: low(2), high(2), step(2), around(-1:1, -1:1), slope(2), bend(2), twist
    real(wp) :: trial(2), found, part
    integer :: i, j, d, best(2)

    do d = 1, 2
      associate (knots => face%axes(d)%knots)
        low(d) = knots(1)
        high(d) = knots(size(knots))
        step(d) = (high(d) - low(d))/(2*n_parts*size(span_table(face%axes(d))))
      end associate
    end do
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

  end subroutine go_down

end module tool_placement
