!> All that is measured, by name.
module catalogue
  use kinds, only: wp
  use text, only: to_text, lower_case
  use strain_projection, only: project_volume, project_sheet, projection_name
  use bench_case, only: bench_case_t, case_slot_t
  use force_case, only: force_case_t
  use user_case, only: user_case_t
  use contact_case, only: contact_case_t, search_case_t, die_case_t
  use channel_case, only: channel_case_t
  use factor_case, only: factor_case_t
  implicit none
  private

  public :: all_cases

contains

  !> Cases in the order in which they run. None is prepared.
  subroutine all_cases(is_quick, cases)
    logical, intent(in) :: is_quick     !! a shorter way for the channel
    type(case_slot_t), allocatable, intent(out) :: cases(:)

    allocate (cases(0))
    call add_rules(cases)
    call add_laws(cases)
    call add_strips(cases)
    call add_shells(cases)
    call add_sizes(cases)
    call add_contacts(cases)
    call add_faces(cases)
    call add_channel(is_quick, cases)
    call add_factors(cases)
  end subroutine all_cases

  subroutine add(cases, item)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    class(bench_case_t), intent(in) :: item
    type(case_slot_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(cases) + 1))
    do i = 1, size(cases)
      call move_alloc(cases(i)%item, longer(i)%item)
    end do
    allocate (longer(size(longer))%item, source=item)
    call move_alloc(longer, cases)
  end subroutine add

  !> Force routine by degree and rule, plain and rational.
  subroutine add_rules(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    !> Degree, points a part, parts along axis 3, 1: rational.
    integer, parameter :: rules(6, 16) = reshape([ &
      2, 3, 3, 3, 1, 0,  2, 2, 2, 3, 1, 0,  2, 2, 2, 2, 1, 0,  2, 2, 2, 2, 3, 0, &
      2, 3, 3, 3, 1, 1,  2, 2, 2, 3, 1, 1,  2, 2, 2, 2, 1, 1,  2, 2, 2, 2, 3, 1, &
      2, 3, 3, 4, 1, 0,  1, 2, 2, 2, 1, 0,  3, 3, 3, 3, 1, 0,  3, 4, 4, 4, 1, 0, &
      2, 2, 3, 2, 1, 0,  1, 1, 1, 2, 1, 0,  4, 4, 4, 4, 1, 0,  5, 5, 5, 5, 1, 0], [6, 16])
    integer :: i

    do i = 1, size(rules, 2)
      call add_force(cases, rules(1, i), rules(2:4, i), [1, 1, rules(5, i)], "voce", &
                     rules(6, i) == 1)
    end do
    call add_force(cases, 2, [3, 3, 3], [1, 1, 1], "voce", .false., projection=project_volume)
    call add_force(cases, 2, [3, 3, 3], [1, 1, 1], "voce", .false., projection=project_sheet)
    call add_force(cases, 2, [2, 2, 3], [1, 1, 1], "voce", .false., projection=project_volume)
    call add_force(cases, 1, [2, 2, 2], [1, 1, 1], "voce", .false., projection=project_sheet)
    call add_force(cases, 2, [3, 3, 3], [1, 1, 1], "voce", .false., projection=project_volume, &
                   is_smooth=.true.)
  end subroutine add_rules

  !> Force routine by law; of a user's subroutine also its bare loop.
  subroutine add_laws(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    character(12), parameter :: laws(18) = [character(12) :: "elastic", "voce_elastic", "swift", &
      "ludwik", "table", "cowper", "johnson", "stages", "neo_hooke", "chaboche", "yoshida", &
      "hill48", "yld91", "yld2000", "yld2004", "umat_small", "umat_voce", "vumat_voce"]
    type(user_case_t) :: bare
    integer :: i

    do i = 1, size(laws)
      call add_force(cases, 2, [2, 2, 3], [1, 1, 1], trim(laws(i)), .false.)
    end do
    call add_force(cases, 2, [2, 2, 3], [1, 1, 1], "voce", .false., is_viscous=.false.)
    do i = size(laws) - 1, size(laws)
      bare%name = "user/"//trim(laws(i))//"/bare"
      bare%per = "element-step"
      bare%loaded%name = bare%name
      bare%loaded%law_name = laws(i)
      bare%loaded%points = [2, 2, 3]
      call add(cases, bare)
    end do
  end subroutine add_laws

  subroutine add_force(cases, degree, points, parts, law, is_rational, is_viscous, &
                       projection, is_smooth)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    integer, intent(in) :: degree, points(3), parts(3)
    character(*), intent(in) :: law
    logical, intent(in) :: is_rational
    logical, intent(in), optional :: is_viscous
    integer, intent(in), optional :: projection     !! its kind, absent: none
    logical, intent(in), optional :: is_smooth
    type(force_case_t) :: item
    character(:), allocatable :: weights, physics
    integer :: q(3)

    q = points*parts
    weights = "plain"
    if (is_rational) weights = "rational"
    physics = "default"
    if (present(is_viscous)) item%is_viscous = is_viscous
    if (.not. item%is_viscous) physics = "no_viscosity"
    if (present(projection)) then
      item%projection%kind = projection
      physics = lower_case(projection_name(projection))
    end if
    if (present(is_smooth)) then
      item%projection%is_smooth = is_smooth
      physics = physics//"_smooth"
    end if
    item%name = "force/p"//to_text(degree)//"/"//to_text(q(1))//"x"//to_text(q(2))//"x"// &
                to_text(q(3))//"/"//law//"/"//weights//"/"//physics
    item%per = "element-step"
    item%degrees = degree
    item%points = points
    item%parts = parts
    item%law_name = law
    item%is_rational = is_rational
    call add(cases, item)
  end subroutine add_force

  !> The force routine on a strip of 2560 elements, by the kernel of plane strain.
  subroutine add_strips(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    character(12), parameter :: laws(3) = [character(12) :: "voce", "voce_elastic", "chaboche"]
    type(force_case_t) :: item
    integer :: i

    item%per = "element-step"
    item%degrees = [2, 1, 2]
    item%points = [2, 1, 2]
    item%parts = [1, 1, 2]
    item%n_elements = [2560, 1, 1]
    item%is_strip = .true.
    do i = 1, size(laws)
      item%law_name = laws(i)
      item%name = "strip/2x1x4/"//trim(laws(i))
      call add(cases, item)
    end do
  end subroutine add_strips

  !> The force routine on shells of 2560 elements with layers split at the middle.
  subroutine add_shells(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    character(12), parameter :: laws(8) = [character(12) :: "voce", "voce_elastic", "elastic", &
                                           "swift", "yoshida", "hill48", "barlat89", "yld2000"]
    type(force_case_t) :: item
    integer :: i

    item%per = "element-step"
    item%is_shell = .true.
    item%points = [2, 2, 3]
    item%parts = [1, 1, 2]
    do i = 1, size(laws)
      item%law_name = laws(i)
      item%name = "shell/p2/2x2/6/"//trim(laws(i))//"/plain"
      call add(cases, item)
    end do
    item%law_name = "voce"
    item%is_rational = .true.
    item%name = "shell/p2/2x2/6/voce/rational"
    call add(cases, item)
    item%is_rational = .false.
    item%degrees = 3
    item%points = 3
    item%name = "shell/p3/3x3/6/voce/plain"
    call add(cases, item)
  end subroutine add_shells

  !> The force routine on blanks of 1e2 to 1e5 elements.
  subroutine add_sizes(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    integer, parameter :: sizes(2, 5) = reshape([20, 5, 40, 25, 160, 50, 200, 50, 500, 200], [2, 5])
    type(force_case_t) :: item
    integer :: i

    item%per = "element-step"
    item%points = [2, 2, 3]
    do i = 1, size(sizes, 2)
      item%n_elements = [sizes(:, i), 1]
      item%name = "elements/"//to_text(product(item%n_elements))
      item%is_long = product(item%n_elements) > 20000
      call add(cases, item)
    end do
  end subroutine add_sizes

  !> Contact on a die of the channel, by number of secondary points, and on a die that is trimmed.
  subroutine add_contacts(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    integer, parameter :: edges(4) = [11, 33, 105, 333]   ! elements, 9 points each
    integer, parameter :: n_points(4) = [1000, 10000, 100000, 1000000]
    integer, parameter :: pieces(2, 2) = reshape([20, 10, 40, 25], [2, 2])   ! of a trimmed die
    type(die_case_t) :: die
    type(contact_case_t) :: item
    integer :: i

    die%name = "contact/closest_point"
    die%per = "point"
    call add(cases, die)
    item%per = "point-step"
    item%name = "contact/step"
    call add(cases, item)
    item%name = "contact/out_of_reach"
    item%height = 6.0_wp
    call add(cases, item)
    item%height = -0.3_wp
    do i = 1, size(edges)
      item%n_sheet = edges(i)
      item%is_long = n_points(i) > 200000
      item%name = "contact/points/"//to_text(n_points(i))
      call add(cases, item)
    end do
    item%n_sheet = 33
    item%is_long = .false.
    item%n_faces = [60, 40]
    item%movement = 0.005_wp       ! some three times that of the decks of input/
    item%name = "contact/die/whole"
    call add(cases, item)
    do i = 1, size(pieces, 2)
      item%n_pieces = pieces(:, i)
      item%name = "contact/die/"//to_text(product(item%n_pieces))//"_pieces"
      call add(cases, item)
    end do
  end subroutine add_contacts

  !> Contact and search by number of faces: of 10 mm each on tools that grow, and on a tool of 1 m
  !! that is cut finer and finer.
  subroutine add_faces(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    integer, parameter :: faces(5) = [10, 32, 100, 316, 1000]   ! along each edge
    integer, parameter :: n_faces(5) = [100, 1000, 10000, 100000, 1000000]
    character(8), parameter :: kinds(2) = [character(8) :: "faces", "refined"]
    type(contact_case_t) :: item
    type(search_case_t) :: search
    integer :: i, kind

    item%per = "point-step"
    search%per = "point"
    do kind = 1, size(kinds)
      do i = 1, size(faces)
        item%n_faces = faces(i)
        item%edge = merge(10.0_wp*faces(i), 1000.0_wp, kind == 1)
        item%is_long = n_faces(i) > 100000
        item%name = "contact/"//trim(kinds(kind))//"/"//to_text(n_faces(i))
        call add(cases, item)
        search%n_faces = item%n_faces
        search%edge = item%edge
        search%is_long = item%is_long
        search%name = "search/"//trim(kinds(kind))//"/"//to_text(n_faces(i))
        call add(cases, search)
      end do
    end do
  end subroutine add_faces

  !> Assembly and factors of a stiffness by its size.
  subroutine add_factors(cases)
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    integer, parameter :: edges(3) = [10, 30, 100]   ! elements
    type(factor_case_t) :: item
    integer :: i

    item%per = "unknown"
    item%is_serial = .true.
    do i = 1, size(edges)
      item%n_elements = edges(i)
      item%is_long = edges(i) > 30
      item%is_assembly = .true.
      item%name = "assembly/"//to_text(edges(i)**2)
      call add(cases, item)
      item%is_assembly = .false.
      item%most_repetitions = merge(3, 20, item%is_long)
      item%name = "factor/"//to_text(edges(i)**2)
      call add(cases, item)
    end do
  end subroutine add_factors

  !> Parts of the channel example, then all of its steps.
  subroutine add_channel(is_quick, cases)
    logical, intent(in) :: is_quick
    type(case_slot_t), allocatable, intent(inout) :: cases(:)
    character(*), parameter :: parts(4) = [character(7) :: "update", "scatter", "history", "frame"]
    character(*), parameter :: units(4) = [character(18) :: "control-point-step", &
      "control-point-step", "row", "frame"]
    type(channel_case_t) :: item
    integer :: i

    do i = 1, size(parts)
      item%part = parts(i)
      item%name = trim(parts(i))
      item%per = trim(units(i))
      item%is_serial = i > 2
      item%is_by_the_wall = i > 3
      call add(cases, item)
    end do
    item%part = "step"
    item%name = "step/channel"
    item%per = "element-step"
    item%is_serial = .false.
    item%most_repetitions = 3
    if (is_quick) item%closing = "closing=30"
    call add(cases, item)
  end subroutine add_channel

end module catalogue
