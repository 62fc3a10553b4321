!> What the readers of keywords share: the names that a deck defines, how the blank lies in space,
!! and which records describe which patch. Case does not matter in names.
module deck_context
  use kinds, only: wp
  use input_errors, only: origin_t, error_list_t, add_error
  use text, only: upper_case, to_text, squeezed
  use knot_vector, only: knot_vector_t
  use name_table, only: name_table_t, insert, place_of
  use keyword_spec, only: did_you_mean, names_material, names_curve, names_patch, &
                          names_tool, names_set, names_point
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, is_option_given
  implicit none
  private

  public :: deck_context_t, deck_names_t, box_frame_t, patch_parts_t, enter_names, enter_name, &
            resolve, resolve_option

  !> Upper-case names; the place of a name is the place of the thing in its list of the scene.
  type :: deck_names_t
    type(name_table_t) :: materials, curves, tools, sets, points
    type(name_table_t) :: patches   !! the blank, its patches and all tools
  end type deck_names_t

  !> Fraction of the length along one axis as a spline of its parametric coordinate.
  type :: box_line_t
    type(knot_vector_t) :: knots
    real(wp), allocatable :: shares(:)    !! at the control points, 0 to 1
  end type box_line_t

  !> How a box blank lies in space: what maps coordinates to parametric coordinates. A blank that
  !! is missing or has errors counts as a box, so that it causes no further errors.
  type :: box_frame_t
    logical :: is_box = .true.
    integer :: axis_of(3) = [1, 2, 3]     !! coordinate along which each parametric axis runs
    real(wp) :: from(3) = 0.0_wp          !! that coordinate where the parametric one is 0
    real(wp) :: to(3) = 1.0_wp            !! and where it is 1
    type(box_line_t) :: lines(3)          !! of a box with evenly spaced control points
  end type box_frame_t

  !> Records that list parts of a patch, in the order of the deck.
  type :: patch_parts_t
    integer, allocatable :: knots(:), points(:), refinements(:)
  end type patch_parts_t

  !> What readers know from the keywords before theirs.
  type :: deck_context_t
    type(deck_names_t) :: names
    type(box_frame_t) :: frame                      !! from *BLANK on
    type(patch_parts_t), allocatable :: parts(:)    !! by place in `names%patches`, from *BLANK on
  end type deck_context_t

contains

  !> Enter the NAME options of all records of a keyword into the table that its entry asks for. A
  !! *TOOL is a patch too; one that is a component of another tool is no tool of its own.
  subroutine enter_names(deck, spec, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: spec                   !! index of the keyword
    type(deck_names_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    type(error_list_t) :: known   ! what the names of patches have shown already
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, deck%keywords(spec)%name)
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        select case (deck%keywords(spec)%names)
        case (names_material); call enter_name(deck, record, names%materials, errors)
        case (names_curve); call enter_name(deck, record, names%curves, errors)
        case (names_patch); call enter_name(deck, record, names%patches, errors)
        case (names_set); call enter_name(deck, record, names%sets, errors)
        case (names_point); call enter_name(deck, record, names%points, errors)
        case (names_tool)
          call enter_name(deck, record, names%patches, errors)
          if (.not. is_option_given(deck, record, "COMPONENT OF")) &
            call enter_name(deck, record, names%tools, known)
        end select
      end associate
    end do
  end subroutine enter_names

  !> Enter one name. A record without a new name takes a place too, under a name none can write.
  !! Names become those of groups in the result file, where slashes and lone points have a meaning.
  subroutine enter_name(deck, record, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(name_table_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name, given
    logical :: is_new

    given = squeezed(option_text(deck, record, "NAME"))
    name = upper_case(given)
    is_new = .false.
    if (name /= "") call insert(names, name, is_new)
    if (name /= "" .and. (scan(name, "/") > 0 .or. verify(name, ".") == 0)) then
      call add_error(errors, record%origin, "the name "//given, "a name without slashes that "// &
                     "is not made of points alone")
    end if
    if (is_new) return
    if (name /= "") call add_error(errors, record%origin, "the name "//given// &
                                   " a second time", "a name of its own")
    call insert(names, "="//to_text(names%n_names), is_new)
  end subroutine enter_name

  !> Place of the thing that goes by a name; 0 and an error if there is none.
  pure subroutine resolve(names, name, what, origin, place, errors)
    type(name_table_t), intent(in) :: names
    character(*), intent(in) :: name
    character(*), intent(in) :: what   !! such as *MATERIAL
    type(origin_t), intent(in) :: origin
    integer, intent(out) :: place
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: hint

    place = place_of(names, squeezed(upper_case(name)))
    if (place > 0) return
    hint = ""
    if (names%n_names > 0) hint = did_you_mean(name, names%names(:names%n_names))
    call add_error(errors, origin, "the unknown name "//name, "the name of a "//what//hint)
  end subroutine resolve

  !> Place of the thing that an option names; 0 if the option is not given or its name is unknown.
  pure subroutine resolve_option(deck, record, option, names, what, place, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: option
    type(name_table_t), intent(in) :: names
    character(*), intent(in) :: what   !! such as *MATERIAL
    integer, intent(out) :: place
    type(error_list_t), intent(inout) :: errors

    place = 0
    if (.not. is_option_given(deck, record, option)) return
    call resolve(names, option_text(deck, record, option), what, record%origin, place, errors)
  end subroutine resolve_option

end module deck_context
